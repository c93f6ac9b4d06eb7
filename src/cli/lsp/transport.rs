//! Messages between an editor and the server: JSON-RPC 2.0 behind `Content-Length` headers, as the
//! Language Server Protocol 3.17 has it.
//!
//! A body that is not JSON gets an error as its answer, because its length is known. After a broken header
//! the server ends: it cannot know where the next message begins.

use std::io::{BufRead, Read, Write};

use serde_json::Value;

/// Longer messages are refused. The largest file that avastra reads fits into one, in JSON.
const MESSAGE_BYTES_MAX: u64 = 128 << 20;

/// A longer header line is rejected as not LSP.
const HEADER_BYTES_MAX: u64 = 1024;

/// Why no more messages can be read.
#[derive(Debug, thiserror::Error)]
pub enum TransportError {
    #[error("the input is not the language server protocol: no `Content-Length` header")]
    Header,
    #[error("a message of {0} bytes is too long")]
    TooLong(u64),
    #[error("the input ends within a message")]
    Cut,
    #[error("the input cannot be read: {0}")]
    Read(#[from] std::io::Error),
}

/// The body of the next message; `None` at the end of the input.
///
/// # Errors
/// If the input is not a message.
pub fn read(input: &mut impl BufRead) -> Result<Option<Vec<u8>>, TransportError> {
    let mut length: Option<u64> = None;
    let mut first = true;
    loop {
        let mut line = Vec::new();
        input.by_ref().take(HEADER_BYTES_MAX).read_until(b'\n', &mut line)?;
        if line.is_empty() && first {
            return Ok(None);
        }
        first = false;
        let Some(line) = line.strip_suffix(b"\n") else { return Err(TransportError::Header) };
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        if line.is_empty() {
            break;
        }
        let line = std::str::from_utf8(line).map_err(|_| TransportError::Header)?;
        let (name, value) = line.split_once(':').ok_or(TransportError::Header)?;
        if name.trim().eq_ignore_ascii_case("content-length") {
            length = Some(value.trim().parse().map_err(|_| TransportError::Header)?);
        }
    }
    let length = length.ok_or(TransportError::Header)?;
    if length > MESSAGE_BYTES_MAX {
        return Err(TransportError::TooLong(length));
    }
    let mut body = Vec::new();
    input.by_ref().take(length).read_to_end(&mut body)?;
    if (body.len() as u64) < length {
        return Err(TransportError::Cut);
    }
    Ok(Some(body))
}

/// Writes a message.
///
/// # Errors
/// If the editor has gone away.
pub fn write(output: &mut impl Write, message: &Value) -> std::io::Result<()> {
    let body = message.to_string();
    write!(output, "Content-Length: {}\r\n\r\n{body}", body.len())?;
    output.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_framed() {
        let mut input: &[u8] = b"Content-Length: 2\r\nContent-Type: x\r\n\r\n{}content-length: 1\n\n7";
        assert_eq!(read(&mut input).unwrap(), Some(b"{}".to_vec()));
        assert_eq!(read(&mut input).unwrap(), Some(b"7".to_vec()));
        assert_eq!(read(&mut input).unwrap(), None);
    }

    #[test]
    fn garbage_is_an_error() {
        let endless = vec![b'a'; 5000];
        let cases: [&[u8]; 7] = [
            b"hello\r\n\r\n",
            b"\r\n",
            b"Content-Length: -1\r\n\r\n",
            b"Content-Length: 99999999999999\r\n\r\n",
            b"Content-Length: 5\r\n\r\n{}",
            b"\xff\xfe:\n\n",
            &endless,
        ];
        for mut case in cases {
            assert!(read(&mut case).is_err(), "{case:?}");
        }
    }
}
