//! The kind of each name, for semantic highlighting: a variant, a state, a word of the engine.
//!
//! Keywords, numbers and comments are coloured by the TextMate grammar.

use avastra_lang::check::{Occurrence, Symbol};

use super::position::Range;
use super::workspace::Analysis;

/// The kind of a name. `cli/lsp` names the kinds in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NameKind {
    Enum,
    Variant,
    Variable,
    Function,
    Parameter,
    Action,
    /// A group, a road, a scenario or a policy.
    Namespace,
    Type,
    /// A rule, a verdict or a word of the engine.
    Property,
}

/// A name of the document.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Token {
    pub range: Range,
    pub kind: NameKind,
    pub declares: bool,
    pub is_constant: bool,
    /// Whether the language or the engine has it, and no file declares it.
    pub is_built_in: bool,
}

/// Every name of the document that stands for something, in the order of the text.
pub fn tokens(analysis: &Analysis) -> Vec<Token> {
    let names = analysis.references().in_file(Analysis::ROOT);
    let token = |occurrence: &Occurrence| {
        let symbol = occurrence.symbols.first()?;
        Some(Token {
            range: analysis.range(occurrence.span),
            kind: kind(symbol)?,
            declares: occurrence.declares,
            is_constant: matches!(symbol, Symbol::Constant(_)),
            is_built_in: matches!(symbol, Symbol::Engine(..) | Symbol::Type(_)),
        })
    };
    names.filter_map(token).collect()
}

fn kind(symbol: &Symbol) -> Option<NameKind> {
    Some(match symbol {
        Symbol::Enum(_) | Symbol::Body(_) => NameKind::Enum,
        Symbol::Variant(..) => NameKind::Variant,
        Symbol::State(_) | Symbol::Constant(_) | Symbol::RoadUser(_) => NameKind::Variable,
        Symbol::Function(_) | Symbol::Manoeuvre(_) => NameKind::Function,
        Symbol::Argument(..) | Symbol::Given(..) | Symbol::Parameter(..) => NameKind::Parameter,
        Symbol::Action(_) => NameKind::Action,
        Symbol::Group(_)
        | Symbol::Trajectory(_)
        | Symbol::Road(_)
        | Symbol::Scenario(_)
        | Symbol::Policy(_) => NameKind::Namespace,
        Symbol::Rule(_) | Symbol::Requirement(_) | Symbol::Verdict(_) | Symbol::Engine(..) => {
            NameKind::Property
        }
        Symbol::Type(_) => NameKind::Type,
        Symbol::File(_) | Symbol::Number(..) => return None,
    })
}
