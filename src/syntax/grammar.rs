//! The parser that pest makes of `grammar/ava.pest`, and the author's words for its rules.
//!
//! `parse`, `build` and `expression` use `Rule`; nothing outside `syntax` does.

/// Generated from the grammar.
#[derive(pest_derive::Parser)]
#[grammar = "../grammar/ava.pest"]
pub struct AvaParser;

/// What an author calls a name.
pub const NAME: &str = "a name";
/// What is expected where a transition names a value.
pub const VARIANT: &str = "a variant";

/// What an author calls a rule, in a sentence that begins "expected …". `None` for rules that are
/// possible in so many places that naming them would not help.
pub fn words(rule: Rule) -> Option<&'static str> {
    Some(match rule {
        Rule::item | Rule::declaration_keyword | Rule::next_declaration => "a declaration",
        Rule::overriding => "a declaration after `override`",
        Rule::expression | Rule::operand | Rule::prefix => "an expression",
        Rule::name | Rule::names => NAME,
        Rule::argument | Rule::argument_name => "an argument",
        Rule::moved => VARIANT,
        Rule::pattern | Rule::arm => "a variant or `_`",
        Rule::initial_key => "a key like `Rain: High`",
        Rule::integer => "a whole number",
        Rule::number | Rule::digits => "a number",
        Rule::text => "a text in `\"`",
        Rule::lane_id => "a lane id",
        Rule::type_name => "a type",
        Rule::function_param => "a parameter",
        Rule::action_param => "a parameter like `each to: Time`",
        Rule::effect | Rule::set | Rule::spawn => "an effect like `set time = to`",
        Rule::transition => "a transition like `Noon -> Night`",
        Rule::field | Rule::field_name => "a field like `speed: 5 m/s`",
        Rule::fields | Rule::open_brace | Rule::initial_keys => "`{`",
        Rule::moves => "`{`",
        Rule::holds | Rule::colon => "`:`",
        Rule::reward_case => "a case like `collision => 1`",
        Rule::policy_line => "a line like `when condition => action()`",
        Rule::step => "a step like `0: action()`",
        Rule::call => "an action like `name()`",
        Rule::arguments => "`(`",
        Rule::otherwise => "`_`",
        Rule::comma => "`,`",
        Rule::equals => "`=`",
        Rule::arrow => "`->`",
        Rule::fat_arrow => "`=>`",
        Rule::bar | Rule::unordered => "`|`",
        Rule::less | Rule::ordered => "`<`",
        Rule::slash => "`/`",
        Rule::close_brace => "`}`",
        Rule::open_paren => "`(`",
        Rule::close_paren => "`)`",
        Rule::open_bracket | Rule::key | Rule::moved_key => "`[`",
        Rule::close_bracket => "`]`",
        Rule::only_set => "an effect like `set count = count + 1`",
        Rule::kw_also => "`also`",
        Rule::kw_step => "`step`",
        Rule::kw_digest => "`digest`",
        Rule::kw_without => "`without`",
        Rule::kw_rule => "`rule`",
        Rule::kw_each => "`each`",
        Rule::kw_any | Rule::drawn_initially => "`any`",
        Rule::kw_in | Rule::within => "`in`",
        Rule::kw_where | Rule::condition => "`where`",
        Rule::kw_set => "`set`",
        Rule::kw_spawn => "`spawn`",
        Rule::kw_ahead => "`ahead`",
        Rule::kw_behind => "`behind`",
        Rule::kw_on | Rule::targets => "`on`",
        Rule::kw_road | Rule::on_road => "`road: name`",
        Rule::kw_at => "`at`",
        Rule::kw_with | Rule::drawn => "`with`",
        Rule::kw_by => "`by`",
        Rule::kw_during | Rule::during => "`during`",
        Rule::kw_once | Rule::once => "`once`",
        Rule::kw_after | Rule::after => "`after`",
        Rule::kw_expect | Rule::expect => "`expect`",
        Rule::kw_origin | Rule::origin => "`origin`",
        Rule::kw_start | Rule::start => "`start`",
        Rule::kw_steps | Rule::steps => "`steps`",
        Rule::kw_net | Rule::net => "`net`",
        Rule::kw_claims | Rule::claims => "`claims`",
        Rule::kw_rules | Rule::policy_rules => "`rules`",
        Rule::kw_when => "`when`",
        _ => return None,
    })
}

/// Whether the rule continues an expression. It may follow every expression, so a message names it only
/// where nothing else is expected. Rules are ordered as they stand in the grammar.
pub fn continues_expression(rule: Rule) -> bool {
    let continues = [Rule::infix, Rule::unit, Rule::index, Rule::field_access, Rule::arguments];
    continues.contains(&rule) || (Rule::op_implies..=Rule::op_divide).contains(&rule)
}

/// Whether the rule is a mark or keyword that the tree does not keep, because the rule around it tells
/// which one it was.
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
