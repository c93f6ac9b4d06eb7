//! The parser that pest makes of `grammar/ava.pest`, and the author's words for its rules.
//!
//! `parse`, `build` and `expression` use `Rule`; nothing outside `syntax` does.

use pest::Parser;
use pest::error::{ErrorVariant, InputLocation};
use pest::iterators::Pairs;

use crate::syntax::ast::{Arithmetic, BinaryOp, Comparison, UnaryOp};
use crate::syntax::keyword::keywords;
use crate::syntax::operator::Operator;

/// Generated from the grammar.
#[derive(pest_derive::Parser)]
#[grammar = "grammar/ava.pest"]
pub struct AvaParser;

/// Reads one declaration.
///
/// # Errors
/// The byte at which the reading fails, and what was expected there.
pub fn lone_item(text: &str) -> Result<Pairs<'_, Rule>, (usize, Vec<Rule>)> {
    AvaParser::parse(Rule::lone_item, text).map_err(|error| {
        let (InputLocation::Pos(at) | InputLocation::Span((at, _))) = error.location;
        match error.variant {
            ErrorVariant::ParsingError { positives, .. } => (at, positives),
            ErrorVariant::CustomError { .. } => (at, Vec::new()),
        }
    })
}

/// The author's word for a name.
pub const NAME: &str = "a name";
/// Expected where an action may go on.
pub const EFFECT: &str = "an effect like `set time = to`";
/// Expected where more effects may go on, which only set states.
pub const ONLY_SET: &str = "an effect like `set count = count + 1`";
/// The words that effects begin with; `set` comes first, for places where effects only set states.
pub const EFFECTS: &[&str] = &["set", "spawn", "order"];
/// Expected where a transition names a value.
pub const VARIANT: &str = "a variant";

/// The role of a rule for the parser and for its messages.
#[derive(Debug, Clone, Copy)]
pub enum Role {
    Operator(Operator),
    /// The author's word for it, in a sentence that begins "expected …".
    Said(&'static str),
    /// Possible in so many places that naming it would not help.
    Unsaid,
}

/// The role of every rule. No `_` stands here, so a new rule of the grammar gets its role here, or avastra does not
/// compile.
pub fn role(rule: Rule) -> Role {
    let binary = |op| Role::Operator(Operator::Binary(op));
    let compare = |op| binary(BinaryOp::Compare(op));
    let arithmetic = |op| binary(BinaryOp::Arithmetic(op));
    match rule {
        Rule::op_not => Role::Operator(Operator::Unary(UnaryOp::Not)),
        Rule::op_negate => Role::Operator(Operator::Unary(UnaryOp::Negate)),
        Rule::op_implies => binary(BinaryOp::Implies),
        Rule::op_or => binary(BinaryOp::Or),
        Rule::op_and => binary(BinaryOp::And),
        Rule::op_in => binary(BinaryOp::In),
        Rule::op_equal => compare(Comparison::Equal),
        Rule::op_not_equal => compare(Comparison::NotEqual),
        Rule::op_less_equal => compare(Comparison::LessEqual),
        Rule::op_less => compare(Comparison::Less),
        Rule::op_greater_equal => compare(Comparison::GreaterEqual),
        Rule::op_greater => compare(Comparison::Greater),
        Rule::op_range => Role::Operator(Operator::Range),
        Rule::op_add => arithmetic(Arithmetic::Add),
        Rule::op_subtract => arithmetic(Arithmetic::Subtract),
        Rule::op_multiply => arithmetic(Arithmetic::Multiply),
        Rule::op_divide => arithmetic(Arithmetic::Divide),
        Rule::item | Rule::declaration_keyword | Rule::next_declaration => Role::Said("a declaration"),
        Rule::overriding => Role::Said("a declaration after `override`"),
        Rule::expression | Rule::operand | Rule::prefix => Role::Said("an expression"),
        Rule::name | Rule::names => Role::Said(NAME),
        Rule::argument | Rule::argument_name => Role::Said("an argument"),
        Rule::moved => Role::Said(VARIANT),
        Rule::pattern | Rule::arm => Role::Said("a variant or `_`"),
        Rule::initial_key => Role::Said("a key like `Rain: High`"),
        Rule::integer => Role::Said("a whole number"),
        Rule::number | Rule::digits => Role::Said("a number"),
        Rule::text => Role::Said("a text in `\"`"),
        Rule::lane_id => Role::Said("a lane id"),
        Rule::type_name => Role::Said("a type"),
        Rule::function_param => Role::Said("a parameter"),
        Rule::action_param => Role::Said("a parameter like `each to: Time`"),
        Rule::effect | Rule::set | Rule::spawn | Rule::order => Role::Said(EFFECT),
        Rule::transition => Role::Said("a transition like `Noon -> Night`"),
        Rule::field | Rule::field_name => Role::Said("a field like `speed: 5 m/s`"),
        Rule::fields | Rule::open_brace | Rule::initial_keys | Rule::moves => Role::Said("`{`"),
        Rule::holds | Rule::colon => Role::Said("`:`"),
        Rule::reward_case => Role::Said("a case like `collision => 1`"),
        Rule::policy_line => Role::Said("a line like `when condition => action()`"),
        Rule::step => Role::Said("a step like `0: action()`"),
        Rule::call => Role::Said("an action like `name()`"),
        Rule::otherwise => Role::Said("`_`"),
        Rule::comma => Role::Said("`,`"),
        Rule::equals => Role::Said("`=`"),
        Rule::arrow => Role::Said("`->`"),
        Rule::fat_arrow => Role::Said("`=>`"),
        Rule::bar | Rule::unordered => Role::Said("`|`"),
        Rule::less | Rule::ordered => Role::Said("`<`"),
        Rule::slash => Role::Said("`/`"),
        Rule::close_brace => Role::Said("`}`"),
        Rule::open_paren | Rule::arguments => Role::Said("`(`"),
        Rule::close_paren => Role::Said("`)`"),
        Rule::open_bracket | Rule::key | Rule::moved_key => Role::Said("`[`"),
        Rule::close_bracket => Role::Said("`]`"),
        Rule::only_set => Role::Said(ONLY_SET),
        Rule::kw_also => Role::Said("`also`"),
        Rule::kw_step => Role::Said("`step`"),
        Rule::kw_digest => Role::Said("`digest`"),
        Rule::kw_without => Role::Said("`without`"),
        Rule::kw_rule => Role::Said("`rule`"),
        Rule::kw_each => Role::Said("`each`"),
        Rule::kw_any | Rule::drawn_initially => Role::Said("`any`"),
        Rule::kw_in | Rule::within => Role::Said("`in`"),
        Rule::kw_where | Rule::condition => Role::Said("`where`"),
        Rule::kw_set => Role::Said("`set`"),
        Rule::kw_spawn => Role::Said("`spawn`"),
        Rule::phase => Role::Said("a phase like `after 3 s { speed: 0 m/s }`"),
        Rule::kw_within | Rule::within_time => Role::Said("`within`"),
        Rule::kw_repeat | Rule::repeat => Role::Said("`repeat`"),
        Rule::kw_as | Rule::bearer => Role::Said("`as`"),
        Rule::kw_of | Rule::of_whom => Role::Said("`of`"),
        Rule::on_trajectory | Rule::along_trajectory => Role::Said("`on`"),
        Rule::kw_apart | Rule::apart => Role::Said("`apart`"),
        Rule::kw_order => Role::Said("`order`"),
        Rule::kw_ahead => Role::Said("`ahead`"),
        Rule::kw_behind => Role::Said("`behind`"),
        Rule::kw_on | Rule::targets => Role::Said("`on`"),
        Rule::kw_road | Rule::on_road => Role::Said("`road: name`"),
        Rule::kw_at => Role::Said("`at`"),
        Rule::kw_with | Rule::drawn => Role::Said("`with`"),
        Rule::kw_by => Role::Said("`by`"),
        Rule::kw_during | Rule::during => Role::Said("`during`"),
        Rule::kw_if | Rule::only_if => Role::Said("`if`"),
        Rule::kw_for | Rule::held => Role::Said("`for`"),
        Rule::kw_once | Rule::once => Role::Said("`once`"),
        Rule::kw_after | Rule::after | Rule::after_event => Role::Said("`after`"),
        Rule::kw_expect | Rule::expect => Role::Said("`expect`"),
        Rule::kw_origin | Rule::origin => Role::Said("`origin`"),
        Rule::kw_start | Rule::start => Role::Said("`start`"),
        Rule::kw_steps | Rule::steps => Role::Said("`steps`"),
        Rule::kw_net | Rule::net => Role::Said("`net`"),
        Rule::kw_claims | Rule::claims => Role::Said("`claims`"),
        Rule::kw_rules | Rule::policy_rules => Role::Said("`rules`"),
        Rule::kw_when | Rule::while_holds => Role::Said("`when`"),
        Rule::kw_unless | Rule::unless_holds => Role::Said("`unless`"),
        Rule::kw_until | Rule::until_holds => Role::Said("`until`"),
        Rule::EOI
        | Rule::WHITESPACE
        | Rule::COMMENT
        | Rule::file
        | Rule::recovered
        | Rule::skipped
        | Rule::likely_declaration
        | Rule::lone_item
        | Rule::lone_fields
        | Rule::language
        | Rule::use_file
        | Rule::enumeration
        | Rule::odds
        | Rule::state
        | Rule::constant
        | Rule::function
        | Rule::manoeuvre
        | Rule::action
        | Rule::cover
        | Rule::also
        | Rule::each_step
        | Rule::group
        | Rule::named_rule
        | Rule::requirement
        | Rule::body
        | Rule::road
        | Rule::trajectory
        | Rule::episode
        | Rule::reward
        | Rule::verdict
        | Rule::clause
        | Rule::scenario
        | Rule::policy
        | Rule::infix
        | Rule::field_access
        | Rule::index
        | Rule::atom
        | Rule::parenthesised
        | Rule::list
        | Rule::record
        | Rule::match_expression
        | Rule::lane_point
        | Rule::numbered
        | Rule::boolean
        | Rule::unit
        | Rule::known_unit
        | Rule::unit_stop
        | Rule::reserved
        | Rule::operator_word
        | Rule::declaring_word
        | Rule::word
        | Rule::word_char
        | Rule::blank
        | Rule::kw_override
        | Rule::kw_language
        | Rule::kw_use
        | Rule::kw_enum
        | Rule::kw_odds
        | Rule::kw_state
        | Rule::kw_let
        | Rule::kw_fn
        | Rule::kw_action
        | Rule::kw_from
        | Rule::kw_group
        | Rule::kw_optional
        | Rule::kw_require
        | Rule::kw_body
        | Rule::kw_trajectory
        | Rule::kw_manoeuvre
        | Rule::kw_episode
        | Rule::kw_reward
        | Rule::kw_verdict
        | Rule::kw_scenario
        | Rule::kw_policy
        | Rule::kw_match
        | Rule::kw_lane => Role::Unsaid,
    }
}

/// The author's word for a rule; `None` for rules that are never named.
pub fn words(rule: Rule) -> Option<&'static str> {
    match role(rule) {
        Role::Said(words) => Some(words),
        Role::Operator(_) | Role::Unsaid => None,
    }
}

/// Whether the rule continues an expression. It may follow every expression, so a message names it only
/// where nothing else is expected.
pub fn continues_expression(rule: Rule) -> bool {
    let continues = [Rule::infix, Rule::unit, Rule::index, Rule::field_access, Rule::arguments];
    continues.contains(&rule) || matches!(role(rule), Role::Operator(operator) if operator.is_infix())
}

/// The keywords with which a text of the rule may begin. pest names a keyword where only one fits, and the rule around
/// it where several do.
pub fn opening_words(rule: Rule) -> Vec<&'static str> {
    match rule {
        Rule::action_param => vec!["each", "any"],
        Rule::effect => vec!["set", "spawn", "order"],
        Rule::phase => vec!["once", "within", "after", "if"],
        Rule::clause => vec!["with", "at", "by"],
        Rule::named_rule => vec!["optional", "rule"],
        Rule::requirement => vec!["optional", "require"],
        Rule::policy_line => vec!["when"],
        Rule::drawn_initially => vec!["any"],
        // The rule of a keyword is `kw_` and the word.
        _ => {
            let name = format!("{rule:?}");
            let word = name.strip_prefix("kw_").and_then(|word| keywords().find(|(known, _)| *known == word));
            word.map(|(word, _)| *word).into_iter().collect()
        }
    }
}

/// Whether the rule is a mark or keyword that the tree does not keep, because the rule around it tells
/// which one it was. Rules are ordered as they stand in the grammar, where marks and keywords stand together; a test keeps
/// that.
pub fn is_plain_terminal(rule: Rule) -> bool {
    let is_kept = matches!(
        rule,
        Rule::kw_each
            | Rule::kw_any
            | Rule::kw_ahead
            | Rule::kw_behind
            | Rule::kw_optional
            | Rule::kw_with
            | Rule::kw_at
            | Rule::kw_by
    );
    rule == Rule::EOI || (Rule::colon..=Rule::kw_lane).contains(&rule) && !is_kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_and_keywords_stand_together_in_the_grammar() {
        let marks = [
            "colon",
            "comma",
            "equals",
            "arrow",
            "fat_arrow",
            "bar",
            "less",
            "slash",
            "open_brace",
            "close_brace",
            "open_paren",
            "close_paren",
            "open_bracket",
            "close_bracket",
        ];
        for rule in Rule::all_rules() {
            let name = format!("{rule:?}");
            let is_terminal = name.starts_with("kw_") || marks.contains(&name.as_str());
            assert_eq!((Rule::colon..=Rule::kw_lane).contains(rule), is_terminal, "{name}");
        }
    }
}
