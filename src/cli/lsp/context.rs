//! What could be written at a place, from the words before it: the text there is unfinished, and no
//! tree can be trusted.

use crate::model::vocabulary::{
    EpisodeField, RoadField, ScenarioClaim, Site, SpaceClaim, SpawnField, StartField, StopReason, WAIT,
    parts_of, things,
};
use crate::syntax::ast::ParamMode;
use crate::syntax::keyword;

use super::names::{Names, Ty};
use super::tokens::{Ending, Token, tokens};
use super::words;
use super::words::Entry;

/// One kind of thing that fits.
#[derive(Debug, Clone, PartialEq)]
pub enum Kind {
    Declarations,
    /// Words of the language or the engine.
    Words(Vec<Entry>),
    Keyword(&'static str),
    Types,
    Enums,
    Units,
    Actions,
    Groups,
    States,
    Roads,
    Rules,
    Verdicts,
    /// What a value can be made of, the variants of this type first.
    Value(Option<Ty>),
    Operators,
    /// Variants of an enum.
    Variants(String),
    /// A parameter; whether its type is the wanted one.
    Local(String, Option<Ty>, bool),
    /// Parameters of an action, and how they get their values.
    Parameters(String, ParamMode),
    /// Files with this extension, beside the document; the path so far.
    Files(&'static str, String),
}

/// What fits at a byte, and where the word begins that it would replace.
pub fn wanted(names: &Names, text: &str, byte: usize) -> (Vec<Kind>, usize) {
    let byte = text.floor_char_boundary(byte.min(text.len()));
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let start = text[..byte].trim_end_matches(is_word).len();
    let item = item_start(text, start);
    match tokens(&text[item..byte]).1 {
        Ending::Comment => return (Vec::new(), start),
        Ending::Text(from) => return path(&text[item..byte], from, item),
        Ending::Code => {}
    }
    let (tokens, _) = tokens(&text[item..start]);
    let line_start = text[..start].rfind('\n').map_or(0, |newline| newline + 1);
    let fresh_line = text[line_start..start].trim().is_empty();
    let place = Place::new(names, tokens, fresh_line);
    let mut found = place.kinds();
    if start == line_start || (place.open.is_empty() && fresh_line && !place.wants_operand()) {
        found.insert(0, Kind::Declarations);
    }
    (found, start)
}

/// Where the declaration around a byte begins: at the last line before it that starts with a keyword.
fn item_start(text: &str, byte: usize) -> usize {
    let mut at = byte;
    loop {
        let start = text[..at].rfind('\n').map_or(0, |newline| newline + 1);
        let word: &str = text[start..].split(|c: char| !c.is_ascii_alphabetic()).next().unwrap_or_default();
        let is_keyword = words::meaning(keyword::DECLARATIONS, word).is_some();
        if start == 0 || is_keyword && start + word.len() <= byte {
            return start;
        }
        at = start - 1;
    }
}

/// Within a text literal: a path, where the language has paths.
fn path(text: &str, from: usize, item: usize) -> (Vec<Kind>, usize) {
    let written = text[from..].to_owned();
    let before = tokens(&text[..from - 1]).0;
    let before: Vec<&str> = before.iter().map(|token| token.text).collect();
    let kinds = match before.as_slice() {
        [.., "use"] => vec![Kind::Files("ava", written)],
        [.., "map", ":"] => vec![Kind::Files("xodr", written)],
        _ => Vec::new(),
    };
    (kinds, item + from)
}

/// The words of a declaration up to the place.
struct Place<'a> {
    names: &'a Names,
    tokens: Vec<Token<'a>>,
    /// Open brackets, by position among the tokens.
    open: Vec<usize>,
    /// Whether nothing stands before the place on its line.
    fresh_line: bool,
    locals: Vec<(String, Option<Ty>)>,
}

impl<'a> Place<'a> {
    fn new(names: &'a Names, mut tokens: Vec<Token<'a>>, fresh_line: bool) -> Place<'a> {
        if tokens.len() > 1 && tokens[0].text == "override" {
            tokens.remove(0);
        }
        let mut open = Vec::new();
        for (index, token) in tokens.iter().enumerate() {
            match token.text {
                "(" | "[" | "{" => open.push(index),
                ")" | "]" | "}" => {
                    open.pop();
                }
                _ => {}
            }
        }
        let mut place = Place { names, tokens, open, fresh_line, locals: Vec::new() };
        place.locals = place.find_locals();
        place
    }

    fn text(&self, index: usize) -> &'a str {
        self.tokens.get(index).map_or("", |token| token.text)
    }

    /// The token before the place; `back` of 1 is the one before that.
    fn last(&self, back: usize) -> &'a str {
        self.tokens.len().checked_sub(back + 1).map_or("", |index| self.text(index))
    }

    fn keyword(&self) -> &'a str {
        if self.text(0) == "optional" { self.text(1) } else { self.text(0) }
    }

    /// What stands before the innermost open bracket, and the bracket.
    fn inside(&self) -> (&'a str, &'a str) {
        match self.open.last() {
            Some(&index) => (index.checked_sub(1).map_or("", |before| self.text(before)), self.text(index)),
            None => ("", ""),
        }
    }

    /// Whether a value is missing, as opposed to an operator or the next entry.
    fn wants_operand(&self) -> bool {
        let last = self.last(0);
        let words =
            ["and", "or", "not", "in", "implies", "where", "match", "spawn", "ahead", "behind", "when"];
        let marks = [
            "=", ":", "(", "[", "{", ",", "+", "-", "*", "/", "<", ">", "<=", ">=", "==", "!=", "=>", "|",
            "..",
        ];
        words.contains(&last) || marks.contains(&last)
    }

    /// Whether the next entry of a block could begin here.
    fn begins_entry(&self) -> bool {
        matches!(self.last(0), "{" | ",") || self.fresh_line && !self.wants_operand()
    }

    fn kinds(&self) -> Vec<Kind> {
        match (self.last(0), self.last(1)) {
            ("", _) => return vec![Kind::Declarations],
            ("override", _) => {
                let fixed = ["language", "use", "expect", "scenario", "policy", "override"];
                let declarations = keyword::DECLARATIONS.iter().copied();
                let open = declarations.filter(|(word, _)| !fixed.contains(word));
                return vec![Kind::Words(open.collect())];
            }
            ("optional", _) => return vec![Kind::Keyword("rule")],
            (".", thing) if things().contains(&thing) => return vec![Kind::Words(parts_of(thing))],
            _ => {}
        }
        if self.tokens.last().is_some_and(Token::is_number)
            && !self.fresh_line
            && self.keyword() != "language"
        {
            let mut kinds = vec![Kind::Units];
            kinds.extend(self.after_value());
            return kinds;
        }
        match self.keyword() {
            "use" => match self.has("without") {
                true => vec![Kind::Actions, Kind::Groups, Kind::Rules],
                false => vec![Kind::Keyword("digest"), Kind::Keyword("without")],
            },
            "odds" => match self.begins_entry() || self.last(0) == "|" {
                true => vec![Kind::Variants(self.text(1).to_owned()), Kind::Keyword("_")],
                false if self.last(0) == "odds" => vec![Kind::Enums],
                false => Vec::new(),
            },
            "state" => self.in_state(),
            "let" if self.tokens.iter().any(|token| token.text == "=") => self.value(None),
            "fn" => self.in_function(),
            "action" => self.in_action(),
            "group" if matches!(self.last(0), "=" | ",") => vec![Kind::Actions, Kind::Groups],
            "rule" => self.in_rule(),
            "road" => self.in_road(),
            "episode" => self.in_episode(),
            "reward" | "verdict" if self.tokens.len() > 1 => self.in_outcome(),
            "expect" => self.in_expect(),
            "scenario" => self.in_scenario(),
            "policy" => self.in_policy(),
            _ => Vec::new(),
        }
    }

    fn in_state(&self) -> Vec<Kind> {
        let equals = self.tokens.iter().position(|token| token.text == "=");
        match (self.last(0), equals) {
            (":", _) => vec![Kind::Types],
            ("->", _) => vec![Kind::Enums],
            ("=", Some(equals)) => {
                let mut kinds = vec![Kind::Keyword("any")];
                kinds.extend(self.value(self.names.declared.named(self.text(equals - 1))));
                kinds
            }
            (_, Some(_)) => self.value(None),
            _ => Vec::new(),
        }
    }

    fn in_function(&self) -> Vec<Kind> {
        let equals = self.tokens.iter().position(|token| token.text == "=");
        match (self.last(0), equals) {
            (":", None) => vec![Kind::Types],
            ("->", None) => vec![Kind::Types],
            (_, Some(equals)) => self.value(self.names.declared.named(self.text(equals - 1))),
            _ => Vec::new(),
        }
    }

    fn in_action(&self) -> Vec<Kind> {
        let is_header = self.open.first().is_some_and(|first| self.text(*first) == "(");
        if is_header {
            let each_or_any = vec![Kind::Keyword("each"), Kind::Keyword("any")];
            return match self.last(0) {
                "(" | "," if self.open.len() == 1 => each_or_any,
                ":" if self.open.len() == 1 => vec![Kind::Types],
                "each" | "any" => Vec::new(),
                _ if self.open.len() == 1 && !self.wants_operand() => {
                    let colon = self.tokens.iter().rposition(|token| token.text == ":").unwrap_or(0);
                    let has = |word: &str| self.tokens[colon..].iter().any(|token| token.text == word);
                    let mut kinds: Vec<Kind> =
                        ["in", "where"].into_iter().filter(|word| !has(word)).map(Kind::Keyword).collect();
                    kinds.extend((has("in") || has("where")).then_some(Kind::Operators));
                    kinds.extend(if self.fresh_line { each_or_any } else { Vec::new() });
                    kinds
                }
                _ => self.value(self.declared_type()),
            };
        }
        let effects = vec![Kind::Keyword("set"), Kind::Keyword("spawn")];
        match (self.open.len(), self.last(0)) {
            (0, _) => Vec::new(),
            (_, "set") => vec![Kind::States],
            (_, "spawn") => {
                let mut kinds = vec![Kind::Words(words::engine_words("body"))];
                kinds.extend(self.value(None));
                kinds
            }
            (1, _) if self.begins_entry() => effects,
            (1, "=") => self.value(self.set_type()),
            (1, _) if self.wants_operand() => self.value(None),
            (1, _) => {
                let mut kinds = vec![Kind::Keyword("ahead"), Kind::Keyword("behind"), Kind::Operators];
                kinds.extend(effects);
                kinds
            }
            (2, ":") => {
                let mut kinds = vec![Kind::Words(words::engine_words(self.last(1)))];
                kinds.extend(self.value(None));
                kinds
            }
            (2, _) if self.begins_entry() && self.inside().1 == "{" => {
                vec![Kind::Words(self.unused(&words::of::<SpawnField>()))]
            }
            _ => self.value(None),
        }
    }

    fn in_rule(&self) -> Vec<Kind> {
        let colon = self.tokens.iter().position(|token| token.text == ":");
        let on = self.tokens.iter().position(|token| token.text == "on");
        let moves = self.open.first().is_some_and(|first| self.text(*first) == "{") && colon.is_none();
        match (self.last(0), colon, on) {
            _ if moves => {
                let state = self.open[0].checked_sub(1).map_or("", |before| self.text(before));
                match self.state(state).as_ref().and_then(Ty::variants_of) {
                    Some(of) => vec![Kind::Variants(of.to_owned())],
                    None => Vec::new(),
                }
            }
            (_, Some(_), _) if self.asks_for_road() => vec![Kind::Roads],
            (_, Some(_), _) => {
                let mut kinds = self.value(Some(Ty::Bool));
                if self.wants_operand() {
                    kinds.push(Kind::Words(words::facts(Site::Rule)));
                    kinds.extend(things().into_iter().map(Kind::Keyword));
                }
                kinds
            }
            ("on" | ",", None, Some(_)) => vec![Kind::Actions, Kind::Groups, Kind::States],
            (_, None, None) if self.tokens.len() > 1 && self.last(0) != "rule" => vec![Kind::Keyword("on")],
            _ => Vec::new(),
        }
    }

    /// Behind `road ==` or within `road in [`.
    fn asks_for_road(&self) -> bool {
        let open = self.open.last().copied().filter(|open| self.text(*open) == "[");
        let of_list = open.and_then(|open| open.checked_sub(2)).map_or("", |index| self.text(index));
        matches!(self.last(0), "==" | "!=") && self.last(1) == "road" || of_list == "road"
    }

    fn in_road(&self) -> Vec<Kind> {
        match self.last(0) {
            ":" if matches!(self.last(1), "start" | "goal") => vec![Kind::Keyword("lane")],
            _ if self.open.len() == 1 && self.begins_entry() => {
                vec![Kind::Words(self.unused(&words::of::<RoadField>()))]
            }
            _ => Vec::new(),
        }
    }

    fn in_episode(&self) -> Vec<Kind> {
        if self.inside().1 == "[" {
            return vec![Kind::Roads];
        }
        if self.begins_entry() {
            return vec![Kind::Words(self.unused(&words::of::<EpisodeField>()))];
        }
        let field = self.tokens.iter().rposition(|token| token.text == ":").map_or(0, |colon| colon - 1);
        match (self.text(field), self.wants_operand()) {
            ("stop", true) => vec![Kind::Words(words::of::<StopReason>())],
            ("stop", false) => vec![Kind::Keyword("or")],
            _ => Vec::new(),
        }
    }

    fn in_outcome(&self) -> Vec<Kind> {
        if !self.wants_operand() && !self.begins_entry() {
            return self.after_value();
        }
        let mut kinds = vec![Kind::Words(words::facts(Site::Verdict))];
        kinds.extend(self.value(None));
        kinds
    }

    fn in_expect(&self) -> Vec<Kind> {
        match self.inside().1 {
            "(" => vec![Kind::Words(words::of::<SpaceClaim>()), Kind::Actions, Kind::Groups],
            _ => vec![Kind::Words(words::of::<SpaceClaim>())],
        }
    }

    fn in_scenario(&self) -> Vec<Kind> {
        let parts = ["origin", "road", "start", "steps", "expect"];
        let block = self.open.get(1).map_or("", |open| self.text(open - 1));
        match (self.open.len(), block) {
            (1, _) if self.last(0) == ":" && self.last(1) == "road" => vec![Kind::Roads],
            (1, _) if self.begins_entry() => {
                let lacking = parts.into_iter().filter(|part| *part == "expect" || !self.has(part));
                lacking.map(Kind::Keyword).collect()
            }
            (1, _) => self.in_claim(),
            (_, "start") => self.in_start(),
            (_, "steps") => self.in_steps(),
            _ => Vec::new(),
        }
    }

    fn in_claim(&self) -> Vec<Kind> {
        let from =
            self.tokens.iter().rposition(|token| token.text == "expect").map_or(0, |expect| expect + 1);
        match (self.last(0), self.text(from)) {
            ("expect", _) => {
                let facts = [words::facts(Site::Verdict), words::of::<ScenarioClaim>()].concat();
                vec![Kind::Words(facts), Kind::Verdicts]
            }
            ("==" | "[" | ",", claim) => {
                let words = words::claim_words(claim).iter().map(|word| (*word, ""));
                vec![Kind::Words(words.collect())]
            }
            _ => ["with", "at", "by"].map(Kind::Keyword).to_vec(),
        }
    }

    fn in_start(&self) -> Vec<Kind> {
        let field = self.open.get(2).map_or_else(|| self.last(1), |open| self.text(open.saturating_sub(2)));
        let state = self.state(field);
        match (self.last(0), self.open.len(), state) {
            (":", 3, Some(Ty::Map(_, value))) => self.value(Some(*value)),
            (_, 3, Some(Ty::Map(key, _))) => vec![Kind::Variants(key)],
            (":", _, Some(Ty::Map(_, value))) => self.value(Some(*value)),
            (":", _, ty) => self.value(ty),
            _ => vec![Kind::States, Kind::Words(words::of::<StartField>())],
        }
    }

    /// Within `steps { 2: drive_ahead(lane: Left) with { speed: 5 m/s } }`.
    fn in_steps(&self) -> Vec<Kind> {
        let (before, bracket) = self.inside();
        match (self.last(0), bracket) {
            (":", "{") if before == "steps" => vec![Kind::Actions, Kind::Words(vec![WAIT])],
            (":", "(") => self.value(self.parameter_type(before)),
            (":", "{") if before == "with" => self.value(self.parameter_type(&self.called())),
            ("(" | ",", "(") => vec![Kind::Parameters(before.to_owned(), ParamMode::Each)],
            (_, "{") if before == "with" => vec![Kind::Parameters(self.called(), ParamMode::Any)],
            (")", _) => vec![Kind::Keyword("with")],
            _ => Vec::new(),
        }
    }

    fn in_policy(&self) -> Vec<Kind> {
        let (before, bracket) = self.inside();
        match (self.open.len(), self.last(0), bracket) {
            (1, _, _) => ["origin", "net", "claims", "rules"].map(Kind::Keyword).to_vec(),
            (_, "=>", _) => vec![Kind::Actions],
            (_, "(" | ",", "(") => match self.names.declared.actions.contains_key(before) {
                true => vec![Kind::Parameters(before.to_owned(), ParamMode::Each)],
                false => self.value(None),
            },
            (_, ":", "(") => self.value(self.parameter_type(before)),
            (2, _, _) if before == "rules" && self.begins_entry() => vec![Kind::Keyword("when")],
            (2, _, _) if before == "rules" => self.value(Some(Ty::Bool)),
            _ => Vec::new(),
        }
    }

    /// The action of the step under way.
    fn called(&self) -> String {
        let with = self.tokens.iter().rposition(|token| token.text == "with").unwrap_or(0);
        let open = self.tokens[..with].iter().rposition(|token| token.text == "(").unwrap_or(0);
        open.checked_sub(1).map_or("", |before| self.text(before)).to_owned()
    }

    /// Type of the parameter whose name stands before the colon.
    fn parameter_type(&self, action: &str) -> Option<Ty> {
        self.names.declared.parameter(action, self.last(1))?.ty.clone()
    }

    fn has(&self, word: &str) -> bool {
        self.tokens.iter().any(|token| token.text == word)
    }

    /// The fields that the innermost block does not have yet.
    fn unused(&self, fields: &[Entry]) -> Vec<Entry> {
        let from = self.open.last().copied().unwrap_or(0);
        let has = |field: &str| {
            let mut pairs = self.tokens[from..].windows(2);
            pairs.any(|pair| pair[0].text == field && pair[1].text == ":")
        };
        fields.iter().copied().filter(|(field, _)| !has(field)).collect()
    }

    /// Where a value may stand: what it can be made of; behind one, what can follow.
    fn value(&self, ty: Option<Ty>) -> Vec<Kind> {
        if let Some(kinds) = self.arm() {
            return kinds;
        }
        if !self.wants_operand() {
            return self.after_value();
        }
        let wanted = self.hint().or(ty);
        // A condition begins with a value of any type.
        let is_open = wanted.as_ref().is_none_or(|wanted| *wanted == Ty::Bool);
        let local = |(name, ty): &(String, Option<Ty>)| {
            Kind::Local(name.clone(), ty.clone(), is_open || *ty == wanted)
        };
        let mut kinds: Vec<Kind> = self.locals.iter().map(local).collect();
        kinds.push(Kind::Value(wanted));
        kinds
    }

    fn after_value(&self) -> Vec<Kind> {
        vec![Kind::Operators]
    }

    /// At the beginning of an arm of `match`.
    fn arm(&self) -> Option<Vec<Kind>> {
        let open = *self.open.last()?;
        let from = self.tokens[..open].iter().rposition(|token| token.text == "match")?;
        if self.text(open) != "{" || from + 2 != open || !(self.begins_entry() || self.last(0) == "|") {
            return None;
        }
        let ty = self.type_of(self.text(from + 1))?;
        Some(vec![Kind::Variants(ty.variants_of()?.to_owned()), Kind::Keyword("_")])
    }

    /// The type that the words before the place ask for.
    fn hint(&self) -> Option<Ty> {
        let end = self.tokens.len();
        match self.last(0) {
            "==" | "!=" | "<" | "<=" | ">" | ">=" => self.type_before(end - 1),
            "[" | "," if self.inside().1 == "[" => {
                let open = *self.open.last()?;
                match self.text(open.checked_sub(1)?) {
                    "in" => self.type_before(open - 1),
                    state => match self.state(state)? {
                        Ty::Map(key, _) => Some(Ty::Enum(key)),
                        Ty::Bool | Ty::Int | Ty::Quantity(_) | Ty::Enum(_) => None,
                    },
                }
            }
            "(" | "," if self.inside().1 == "(" => {
                let open = *self.open.last()?;
                let function = self.names.declared.functions.get(self.text(open.checked_sub(1)?))?;
                let commas = self.tokens[open..].iter().filter(|token| token.text == ",").count();
                function.of.parameters.get(commas)?.1.clone()
            }
            _ => None,
        }
    }

    /// Type of the value that ends before a token: a name, `state[key]` or `function(…)`.
    fn type_before(&self, end: usize) -> Option<Ty> {
        let last = end.checked_sub(1)?;
        let back_to = |bracket: &str| self.tokens[..last].iter().rposition(|token| token.text == bracket);
        match self.text(last) {
            "]" => match self.state(self.text(back_to("[")?.checked_sub(1)?))? {
                Ty::Map(_, value) => Some(*value),
                Ty::Bool | Ty::Int | Ty::Quantity(_) | Ty::Enum(_) => None,
            },
            ")" => {
                let function = self.text(back_to("(")?.checked_sub(1)?);
                self.names.declared.functions.get(function)?.of.result.clone()
            }
            name => self.type_of(name),
        }
    }

    fn type_of(&self, name: &str) -> Option<Ty> {
        let local = self.locals.iter().find(|(local, _)| local == name);
        let constant = || self.names.declared.constants.get(name).and_then(|of| of.of.clone());
        local.and_then(|(_, ty)| ty.clone()).or_else(constant).or_else(|| self.state(name))
    }

    fn state(&self, name: &str) -> Option<Ty> {
        self.names.declared.states.get(name)?.of.clone()
    }

    /// Type of the parameter of an action that is being declared.
    fn declared_type(&self) -> Option<Ty> {
        let colon = self.tokens.iter().rposition(|token| token.text == ":")?;
        self.names.declared.named(self.text(colon + 1))
    }

    /// Type of what `set` sets.
    fn set_type(&self) -> Option<Ty> {
        let set = self.tokens.iter().rposition(|token| token.text == "set")?;
        match self.state(self.text(set + 1))? {
            Ty::Map(_, value) => Some(*value),
            ty => Some(ty),
        }
    }

    /// The parameters that can be named.
    fn find_locals(&self) -> Vec<(String, Option<Ty>)> {
        let declared = &self.names.declared;
        let mut found: Vec<(String, Option<Ty>)> = Vec::new();
        match self.keyword() {
            "rule" => {
                let from = self.tokens.iter().position(|token| token.text == "on");
                let names = self.tokens.iter().skip(from.map_or(usize::MAX, |on| on + 1));
                let names = names.take_while(|token| token.text != ":").filter(|token| token.is_word());
                for action in names.flat_map(|name| declared.targets(name.text)) {
                    for parameter in declared.actions.get(&action).iter().flat_map(|action| &action.of) {
                        if !found.iter().any(|(name, _)| *name == parameter.name) {
                            found.push((parameter.name.clone(), parameter.ty.clone()));
                        }
                    }
                }
            }
            keyword @ ("fn" | "action") => {
                for at in 1..self.tokens.len() {
                    let is_parameter = self.text(at + 1) == ":"
                        && match keyword {
                            "fn" => matches!(self.text(at - 1), "(" | ","),
                            _ => matches!(self.text(at - 1), "each" | "any"),
                        };
                    if is_parameter && self.tokens[at].is_word() {
                        found.push((self.text(at).to_owned(), declared.named(self.text(at + 2))));
                    }
                }
            }
            _ => {}
        }
        found
    }
}
