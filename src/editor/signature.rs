//! Signature help: the parameters of the function or action whose arguments are being written.

use avastra_lang::check::Symbol;
use avastra_lang::syntax::declaration_start;

use super::hover;
use super::tokens::{Token, tokens};
use super::workspace::Analysis;

/// How a function or an action is called.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Signature {
    pub label: String,
    /// Each a part of the label.
    pub parameters: Vec<String>,
    /// Position of the parameter that is being written.
    pub due: usize,
    /// In Markdown.
    pub text: String,
}

/// The signature of the innermost call around a byte of the document.
pub fn help(analysis: &Analysis, byte: usize) -> Option<Signature> {
    let text = analysis.text(Analysis::ROOT);
    let item = declaration_start(text, byte);
    let tokens = tokens(text.get(item..byte)?);
    let (name, written) = call(&tokens)?;
    let references = analysis.references();
    let of = [Symbol::Function(name.to_owned()), Symbol::Action(name.to_owned())];
    let (symbol, declared) = of.iter().find_map(|symbol| Some((symbol, references.declaration(symbol)?)))?;
    // The arguments of an action are its `each` parameters, by name.
    let is_function = matches!(symbol, Symbol::Function(_));
    let parts = declared.parts.iter().filter_map(|part| Some((part, references.declaration(part)?)));
    let parts: Vec<(&str, String)> = parts
        .filter(|(_, known)| is_function || known.axis)
        .filter_map(|(part, known)| Some((part.word()?, known.type_name(references).unwrap_or_default())))
        .collect();
    let due = match is_function {
        true => written.iter().filter(|token| token.text == ",").count(),
        false => {
            let entry = written.iter().rposition(|token| token.text == ",").map_or(0, |comma| comma + 1);
            let named = written.get(entry).map_or("", |token| token.text);
            parts
                .iter()
                .position(|(name, _)| *name == named)
                .unwrap_or(entry.min(written.len()).min(parts.len()))
        }
    };
    let labels: Vec<String> = parts.iter().map(|(name, ty)| format!("{name}: {ty}")).collect();
    let result = declared.type_name(references).filter(|_| is_function);
    let result = result.map_or(String::new(), |ty| format!(" -> {ty}"));
    let label = format!("{name}({}){result}", labels.join(", "));
    let text = hover::describe(analysis, symbol).unwrap_or_default();
    Some(Signature { label, parameters: labels, due, text })
}

/// The name before the innermost open `(`, and what is written behind it so far, without what nested brackets hold.
fn call<'a>(written: &[Token<'a>]) -> Option<(&'a str, Vec<Token<'a>>)> {
    let (mut open, mut levels) = (Vec::new(), vec![Vec::new()]);
    for (index, token) in written.iter().enumerate() {
        match token.text {
            "(" | "[" | "{" => {
                open.push(index);
                levels.push(Vec::new());
            }
            ")" | "]" | "}" if !open.is_empty() => {
                open.pop();
                levels.pop();
            }
            _ => levels.last_mut()?.push(*token),
        }
    }
    let innermost = open.last().copied().filter(|index| written[*index].text == "(")?;
    let name = written.get(innermost.checked_sub(1)?).filter(|token| token.is_word())?;
    // `action name(` and `fn name(` declare; they do not call.
    let before = innermost.checked_sub(2).map_or("", |index| written[index].text);
    (!["action", "fn"].contains(&before)).then(|| (name.text, levels.pop().unwrap_or_default()))
}
