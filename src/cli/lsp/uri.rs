//! Names of files: `file://` URIs in an editor, paths here.
//!
//! A document that is no file (`untitled:…`) keeps its URI for a path. Only the editor can give its text,
//! and the paths that it uses are relative to no folder.

use std::path::{Path, PathBuf};

use avastra_lang::check::normal;

/// The path that a URI names.
pub fn to_path(uri: &str) -> PathBuf {
    let Some(rest) = uri.strip_prefix("file://") else { return PathBuf::from(uri) };
    // `file://host/path`: the host is ignored. Editors send none.
    let path = rest.find('/').map_or(rest, |slash| &rest[slash..]);
    let text = decoded(path);
    // `file:///c:/space.ava` on Windows.
    let is_drive = matches!(text.as_bytes(), [b'/', letter, b':', ..] if letter.is_ascii_alphabetic());
    normal(Path::new(if is_drive { &text[1..] } else { &text }))
}

/// The URI of a path.
pub fn from_path(path: &Path) -> String {
    let text = path.to_string_lossy().replace('\\', "/");
    if !path.is_absolute() {
        return text;
    }
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"/-._~".contains(&byte);
    let encode = |byte: u8| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") };
    let encoded: String = text.bytes().map(encode).collect();
    format!("file://{}{encoded}", if encoded.starts_with('/') { "" } else { "/" })
}

/// Replaces escapes like `%20` by the bytes that they mean. A broken escape stays as it is.
fn decoded(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut found = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let hex = text.get(at + 1..at + 3).filter(|_| bytes[at] == b'%');
        match hex.and_then(|hex| u8::from_str_radix(hex, 16).ok()) {
            Some(byte) => {
                found.push(byte);
                at += 3;
            }
            None => {
                found.push(bytes[at]);
                at += 1;
            }
        }
    }
    String::from_utf8_lossy(&found).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris_and_paths_name_the_same() {
        let path = Path::new("/a b/\u{e4}%/space.ava");
        assert_eq!(from_path(path), "file:///a%20b/%C3%A4%25/space.ava");
        assert_eq!(to_path(&from_path(path)), path);
        assert_eq!(to_path("file:///x/./y/../space.ava"), Path::new("/x/space.ava"));
        assert_eq!(to_path("file:///broken%zz%"), Path::new("/broken%zz%"));
        assert_eq!(to_path("untitled:Untitled-1"), Path::new("untitled:Untitled-1"));
    }
}
