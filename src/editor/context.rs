//! What could be written at a place, told from the words before it: the declaration there is unfinished and
//! has no tree. Why the grammar is not asked instead is said in docs/decisions.md, 34.

use crate::check::{Declaration, References, Symbol};
use crate::model::Type;
use crate::model::vocabulary::{
    CHANGE, EpisodeField, RoadField, ScenarioClaim, Site, SpaceClaim, SpawnField, StartField, StopReason,
    WAIT, Word as _, parts_of, things,
};
use crate::syntax::keyword;

use super::tokens::{Ending, Token, tokens};
use super::words;
use super::words::Entry;

/// A kind of thing that can be written at a place.
#[derive(Debug, Clone, PartialEq)]
pub enum Kind {
    Declarations,
    /// Words of the language or the engine.
    Words(Vec<Entry>),
    Keyword(&'static str),
    Types,
    Enums,
    /// The bodies of the engine, and those that are declared.
    Bodies,
    Units,
    Actions,
    Groups,
    States,
    Roads,
    Rules,
    Verdicts,
    Functions,
    Constants,
    /// The parts of an expression; the variants of this type come first.
    Value(Option<Type>),
    Operators,
    /// Variants of an enum.
    Variants(String),
    /// A parameter, its type, and whether this is the wanted type.
    Local(String, Option<Type>, bool),
    /// Parameters of an action: the axes if `true`, else the drawn ones.
    Parameters(String, bool),
    /// Files with this extension, and the path that is written so far.
    Files(&'static str, String),
}

/// The kinds that fit at a byte, and the start of the word that a proposal would replace.
pub fn wanted(references: &References, text: &str, byte: usize) -> (Vec<Kind>, usize) {
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
    let place = Place::new(references, tokens, fresh_line);
    let mut found = place.kinds();
    if start == line_start || (place.open.is_empty() && fresh_line && !place.wants_operand()) {
        found.insert(0, Kind::Declarations);
    }
    (found, start)
}

/// Where the declaration around a byte begins: at the last line before it that starts with a keyword.
pub fn item_start(text: &str, byte: usize) -> usize {
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

/// The kinds that fit within a text literal: files, if the text is a path.
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

/// What the declaration after `override` and a keyword may replace.
fn replaceable(keyword: &str) -> Vec<Kind> {
    match keyword {
        "enum" | "odds" => vec![Kind::Enums],
        "state" => vec![Kind::States],
        "let" => vec![Kind::Constants],
        "fn" => vec![Kind::Functions],
        "action" => vec![Kind::Actions],
        "group" => vec![Kind::Groups],
        "rule" => vec![Kind::Rules],
        "road" => vec![Kind::Roads],
        "verdict" => vec![Kind::Verdicts],
        _ => Vec::new(),
    }
}

/// The tokens of a declaration up to the place.
struct Place<'a> {
    references: &'a References,
    tokens: Vec<Token<'a>>,
    /// Positions of the open brackets among the tokens.
    open: Vec<usize>,
    /// Whether the place is the first on its line.
    fresh_line: bool,
    /// Whether the declaration replaces another.
    overrides: bool,
    locals: Vec<(String, Option<Type>)>,
}

impl<'a> Place<'a> {
    fn new(references: &'a References, mut tokens: Vec<Token<'a>>, fresh_line: bool) -> Place<'a> {
        let overrides = tokens.len() > 1 && tokens[0].text == "override";
        if overrides {
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
        let mut place = Place { references, tokens, open, fresh_line, overrides, locals: Vec::new() };
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

    /// Whether a value must come next, and not an operator or the next entry.
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
            (keyword, _) if self.overrides && self.tokens.len() == 1 && keyword != "optional" => {
                return replaceable(keyword);
            }
            ("optional", _) => return vec![Kind::Keyword("rule")],
            (".", thing) if things().contains(&thing) => return vec![Kind::Words(parts_of(thing))],
            _ => {}
        }
        if self.tokens.last().is_some_and(Token::is_number)
            && !self.fresh_line
            && self.keyword() != "language"
        {
            return vec![Kind::Units, Kind::Operators];
        }
        match self.keyword() {
            "use" => match self.has("without") {
                true => vec![Kind::Actions, Kind::Groups, Kind::Rules],
                false => vec![Kind::Keyword("digest"), Kind::Keyword("without")],
            },
            "odds" => match self.begins_entry() || self.last(0) == "|" {
                true if self.text(1) == SpaceClaim::Actions.name() => {
                    vec![Kind::Actions, Kind::Groups, Kind::Keyword("_")]
                }
                true => vec![Kind::Variants(self.text(1).to_owned()), Kind::Keyword("_")],
                false if self.last(0) == "odds" => vec![Kind::Enums],
                false => Vec::new(),
            },
            "state" => self.in_state(),
            "let" if self.tokens.iter().any(|token| token.text == "=") => self.value(None),
            "fn" => self.in_function(),
            "action" | "each" => self.in_action(),
            "on" if self.open.is_empty() => match self.last(0) {
                "on" | "," => vec![Kind::Actions, Kind::Groups],
                "also" => Vec::new(),
                _ => vec![Kind::Keyword("also")],
            },
            "on" => self.in_action(),
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
                kinds.extend(self.value(self.references.type_named(self.text(equals - 1))));
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
            (_, Some(equals)) => self.value(self.references.type_named(self.text(equals - 1))),
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
                let mut kinds = vec![Kind::Bodies];
                kinds.extend(self.value(None));
                kinds
            }
            (1, "behind") if self.last(1) == "from" => {
                let mut kinds = vec![Kind::Bodies];
                kinds.extend(self.value(None));
                kinds
            }
            (1, _) if self.begins_entry() => effects,
            (1, "=") => self.value(self.set_type()),
            (1, _) if self.wants_operand() => self.value(None),
            (1, _) => {
                let places = ["ahead", "behind", "from"].map(Kind::Keyword);
                let mut kinds: Vec<Kind> = places.into_iter().chain([Kind::Operators]).collect();
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
                self.plain_state(state).and_then(|ty| self.variants(ty)).into_iter().collect()
            }
            (_, Some(_), _) if self.asks_for_road() => vec![Kind::Roads],
            (_, Some(_), _) => {
                let mut kinds = self.value(Some(Type::Bool));
                if self.wants_operand() {
                    kinds.push(Kind::Words(words::facts(Site::Rule)));
                    kinds.extend(things().into_iter().map(Kind::Keyword));
                }
                kinds
            }
            ("during", ..) => vec![Kind::Words(vec![CHANGE])],
            ("on" | ",", None, Some(_)) => vec![Kind::Actions, Kind::Groups, Kind::States],
            (_, None, None) if self.tokens.len() > 1 && self.last(0) != "rule" => {
                ["on", "during"].map(Kind::Keyword).to_vec()
            }
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
            return vec![Kind::Operators];
        }
        let open = self.open.last().copied().filter(|open| self.text(*open) == "[");
        let compared = match (self.last(0), open) {
            ("==" | "!=", _) => self.last(1),
            ("[" | ",", Some(open)) if open >= 2 && self.text(open - 1) == "in" => self.text(open - 2),
            _ => "",
        };
        if matches!(compared, "hit" | "near") {
            return vec![Kind::Bodies];
        }
        let site = if self.keyword() == "reward" { Site::Reward } else { Site::Verdict };
        let mut kinds = vec![Kind::Words(words::facts(site))];
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
        let key = state.and_then(|state| state.key);
        match (self.last(0), self.open.len(), key) {
            (":", _, _) => self.value(state.and_then(|state| state.ty)),
            (_, 3, Some(key)) => self.variants(Type::Enum(key)).into_iter().collect(),
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
            ("(" | ",", "(") => vec![Kind::Parameters(before.to_owned(), true)],
            (_, "{") if before == "with" => vec![Kind::Parameters(self.called(), false)],
            (")", _) => ["with", "once", "after"].map(Kind::Keyword).to_vec(),
            _ => Vec::new(),
        }
    }

    fn in_policy(&self) -> Vec<Kind> {
        let (before, bracket) = self.inside();
        match (self.open.len(), self.last(0), bracket) {
            (1, _, _) => ["origin", "net", "claims", "rules"].map(Kind::Keyword).to_vec(),
            (_, "=>", _) => vec![Kind::Actions],
            (_, "(" | ",", "(") => match self.declared(Symbol::Action, before) {
                Some(_) => vec![Kind::Parameters(before.to_owned(), true)],
                None => self.value(None),
            },
            (_, ":", "(") => self.value(self.parameter_type(before)),
            (2, _, _) if before == "rules" && self.begins_entry() => vec![Kind::Keyword("when")],
            (2, _, _) if before == "rules" => self.value(Some(Type::Bool)),
            _ => Vec::new(),
        }
    }

    /// The action that the unfinished step calls.
    fn called(&self) -> String {
        let with = self.tokens.iter().rposition(|token| token.text == "with").unwrap_or(0);
        let open = self.tokens[..with].iter().rposition(|token| token.text == "(").unwrap_or(0);
        open.checked_sub(1).map_or("", |before| self.text(before)).to_owned()
    }

    /// Type of the parameter whose name stands before the colon.
    fn parameter_type(&self, action: &str) -> Option<Type> {
        let symbol = Symbol::Parameter(action.to_owned(), self.last(1).to_owned());
        self.references.declaration(&symbol)?.ty
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

    /// The kinds that fit in an expression: the parts of a value, or what can follow one.
    fn value(&self, ty: Option<Type>) -> Vec<Kind> {
        if let Some(kinds) = self.arm() {
            return kinds;
        }
        if !self.wants_operand() {
            return vec![Kind::Operators];
        }
        let wanted = self.hint().or(ty);
        // A condition may begin with a value of any type.
        let is_open = wanted.is_none_or(|wanted| wanted == Type::Bool);
        let local =
            |(name, ty): &(String, Option<Type>)| Kind::Local(name.clone(), *ty, is_open || *ty == wanted);
        let mut kinds: Vec<Kind> = self.locals.iter().map(local).collect();
        kinds.push(Kind::Value(wanted));
        kinds
    }

    /// The variants for the start of an arm of `match`; `None` elsewhere.
    fn arm(&self) -> Option<Vec<Kind>> {
        let open = *self.open.last()?;
        let from = self.tokens[..open].iter().rposition(|token| token.text == "match")?;
        if self.text(open) != "{" || from + 2 != open || !(self.begins_entry() || self.last(0) == "|") {
            return None;
        }
        let variants = self.variants(self.type_of(self.text(from + 1))?)?;
        Some(vec![variants, Kind::Keyword("_")])
    }

    /// The type that the tokens before the place ask for.
    fn hint(&self) -> Option<Type> {
        let end = self.tokens.len();
        match self.last(0) {
            "==" | "!=" | "<" | "<=" | ">" | ">=" => self.type_before(end - 1),
            "[" | "," if self.inside().1 == "[" => {
                let open = *self.open.last()?;
                match self.text(open.checked_sub(1)?) {
                    "in" => self.type_before(open - 1),
                    state => self.state(state)?.key.map(Type::Enum),
                }
            }
            "(" | "," if self.inside().1 == "(" => {
                let open = *self.open.last()?;
                let function = self.declared(Symbol::Function, self.text(open.checked_sub(1)?))?;
                let commas = self.tokens[open..].iter().filter(|token| token.text == ",").count();
                self.references.declaration(function.parts.get(commas)?)?.ty
            }
            _ => None,
        }
    }

    /// Type of the value that ends before a token: a name, `state[key]` or `function(…)`.
    fn type_before(&self, end: usize) -> Option<Type> {
        let last = end.checked_sub(1)?;
        let back_to = |bracket: &str| self.tokens[..last].iter().rposition(|token| token.text == bracket);
        match self.text(last) {
            "]" => self.state(self.text(back_to("[")?.checked_sub(1)?))?.ty,
            ")" => self.declared(Symbol::Function, self.text(back_to("(")?.checked_sub(1)?))?.ty,
            name => self.type_of(name),
        }
    }

    fn type_of(&self, name: &str) -> Option<Type> {
        let local = self.locals.iter().find(|(local, _)| local == name);
        let constant = || self.declared(Symbol::Constant, name).and_then(|constant| constant.ty);
        local.and_then(|(_, ty)| *ty).or_else(constant).or_else(|| self.plain_state(name))
    }

    /// Type of a state that is no map.
    fn plain_state(&self, name: &str) -> Option<Type> {
        self.state(name).filter(|state| state.key.is_none())?.ty
    }

    fn state(&self, name: &str) -> Option<&'a Declaration> {
        self.declared(Symbol::State, name)
    }

    fn declared(&self, symbol: fn(String) -> Symbol, name: &str) -> Option<&'a Declaration> {
        self.references.declaration(&symbol(name.to_owned()))
    }

    /// The variants of an enum.
    fn variants(&self, ty: Type) -> Option<Kind> {
        self.references.enum_of(ty).map(|of| Kind::Variants(of.name.clone()))
    }

    /// Type of the parameter of an action that is being declared.
    fn declared_type(&self) -> Option<Type> {
        let colon = self.tokens.iter().rposition(|token| token.text == ":")?;
        self.references.type_named(self.text(colon + 1))
    }

    /// Type of what `set` sets.
    fn set_type(&self) -> Option<Type> {
        let set = self.tokens.iter().rposition(|token| token.text == "set")?;
        self.state(self.text(set + 1))?.ty
    }

    /// The parameters that an expression at the place can name.
    fn find_locals(&self) -> Vec<(String, Option<Type>)> {
        let mut found: Vec<(String, Option<Type>)> = Vec::new();
        match self.keyword() {
            "rule" => {
                let from = self.tokens.iter().position(|token| token.text == "on");
                let names = self.tokens.iter().skip(from.map_or(usize::MAX, |on| on + 1));
                let names = names.take_while(|token| token.text != ":").filter(|token| token.is_word());
                for (name, ty) in names.flat_map(|name| self.parameters_of(name.text)) {
                    if !found.iter().any(|(known, _)| *known == name) {
                        found.push((name, ty));
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
                        found.push((self.text(at).to_owned(), self.references.type_named(self.text(at + 2))));
                    }
                }
            }
            _ => {}
        }
        found
    }

    /// Parameters of an action, or of the actions of a group.
    fn parameters_of(&self, target: &str) -> Vec<(String, Option<Type>)> {
        let actions = self.references.actions(target);
        let actions = actions.iter().filter_map(|action| self.references.declaration(action));
        let parameter = |symbol: &Symbol| match symbol {
            Symbol::Parameter(_, name) => Some((name.clone(), self.references.declaration(symbol)?.ty)),
            _ => None,
        };
        actions.flat_map(|action| &action.parts).filter_map(parameter).collect()
    }
}
