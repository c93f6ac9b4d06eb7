//! The action table of a space: what each row would do now, or which rule refuses it.

use std::sync::Arc;

use crate::action::draw::Judge;
use crate::action::{Course, Effect, LaneChangeRules, Surroundings};
use avastra_lang::model::expr::Expr;
use avastra_lang::model::{
    ActionDef, EffectDef, Facts, Memory, Road, Row, RulesInForce, Space, Type, Value, WorldFacts, evaluate,
};

/// The rows that an agent chooses from.
#[derive(Debug, Clone)]
pub struct ActionTable {
    space: Arc<Space>,
}

/// The moment in which a row is offered or judged.
#[derive(Clone, Copy)]
pub struct Situation<'a> {
    pub memory: &'a Memory,
    pub road: &'a Road,
    pub rules: &'a RulesInForce,
    pub surroundings: &'a dyn Surroundings,
    /// Seed of the episode.
    pub seed: u64,
    /// Number of the step, from 0.
    pub step: u64,
    /// When each action last happened, s since the episode began, minus infinity for never; empty if the space does not ask.
    pub happened_s: &'a [f64],
}

/// The part of the steps in which actions that only set states come, by the balanced odds. Half of the rows of
/// `avastra45.ava` are such, and weather alone hits no road user. Ours.
const SETTING_SHARE: f64 = 0.15;

/// How often a row is drawn by chance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RowOdds {
    /// Relative to the other rows that have shares.
    Share(f64),
    /// Its action comes in this part of the steps, whichever of its rows is legal.
    Chance { action: usize, chance: f64 },
}

/// The result of choosing a legal row now, or why the row is refused.
pub type Offer = Result<Draw, Refusal>;

/// A row with its drawn values.
#[derive(Debug, Clone, PartialEq)]
pub struct Draw {
    pub row: usize,
    /// Values of the `any` parameters, as declared; numbers in SI units.
    pub values: Vec<(Arc<str>, Value)>,
    /// Its effects on the world, in order.
    pub effects: Vec<Effect>,
    pub memory_after: Memory,
    /// Rules on the lane changes of what it makes appear or orders; `None` without any.
    pub lane_changes: Option<Arc<LaneChangeRules>>,
    /// The manoeuvres of what it makes appear or orders, each with the index of its effect.
    pub courses: Vec<(usize, Arc<Course>)>,
}

/// Why a row cannot be chosen.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// The rule that refuses; `None` if the world has no place for a spawn, or a value is out of range or
    /// breaks a `where`.
    pub rule: Option<String>,
    /// In words, with figures.
    pub reason: String,
}

impl Refusal {
    /// The reason, after the rule if there is one.
    pub fn in_words(&self) -> String {
        match &self.rule {
            Some(rule) => format!("rule `{rule}`: {}", self.reason),
            None => self.reason.clone(),
        }
    }
}

impl Draw {
    /// Whether it makes road users appear.
    pub fn makes_appear(&self) -> bool {
        self.effects.iter().any(|effect| effect.newcomers() > 0)
    }

    /// The manoeuvre that one of its effects gives to a road user.
    pub fn course(&self, effect: usize) -> Option<&Arc<Course>> {
        self.courses.iter().find(|(index, _)| *index == effect).map(|(_, course)| course)
    }
}

impl ActionTable {
    pub fn new(space: Arc<Space>) -> ActionTable {
        ActionTable { space }
    }

    pub fn space(&self) -> &Arc<Space> {
        &self.space
    }

    pub fn rows(&self) -> &[Row] {
        &self.space.rows
    }

    /// How often each row is drawn by chance: by `odds actions`, or else balanced.
    pub fn odds(&self, situation: &Situation<'_>) -> Vec<RowOdds> {
        let Situation { memory, road, .. } = *situation;
        let space = &self.space;
        let declared: Option<Vec<&Expr>> = space.actions.iter().map(|action| action.odds.as_ref()).collect();
        let Some(declared) = declared else { return self.balanced() };
        let bearers = || declared.iter().flat_map(|odds| odds.bearers(space.bearers.len()));
        let asks_the_world = declared.iter().any(|odds| odds.asks_the_world());
        let world = asks_the_world.then(|| world_facts(situation, bearers()));
        let facts = Facts { road: Some(&road.facts), world: world.as_ref(), ..Facts::new(&[], memory) };
        let odds = |(action, odds): (usize, &&Expr)| {
            let value = evaluate(odds, &space.functions, &facts).number();
            match odds.ty {
                // Odds without a value (a division by 0) never come.
                Type::Quantity(_) => {
                    RowOdds::Chance { action, chance: (value * space.episode.step_s).max(0.0) }
                }
                Type::Int | Type::Bool | Type::Enum(_) => RowOdds::Share(value),
            }
        };
        let of_actions: Vec<RowOdds> = declared.iter().enumerate().map(odds).collect();
        self.rows().iter().map(|row| of_actions[row.action]).collect()
    }

    /// Odds by which each action is as likely as another, but those that only set states (weather, time) have [`SETTING_SHARE`]
    /// together. The rows of an action share what it has.
    fn balanced(&self) -> Vec<RowOdds> {
        let actions = &self.space.actions;
        let only_sets =
            |action: &ActionDef| action.effects.iter().all(|effect| matches!(effect, EffectDef::Set(_)));
        let sets: Vec<bool> =
            actions.iter().map(|action| !action.effects.is_empty() && only_sets(action)).collect();
        let mut rows = vec![0_u32; actions.len()];
        self.rows().iter().for_each(|row| rows[row.action] += 1);
        let number = |wanted: bool| {
            let counted = sets.iter().zip(&rows).filter(|(sets, rows)| **sets == wanted && **rows > 0);
            counted.count() as f64
        };
        let (setting, others) = (number(true), number(false));
        let share = |row: &Row| {
            let of_action = match sets[row.action] {
                _ if setting == 0.0 || others == 0.0 => 1.0,
                true => SETTING_SHARE / setting,
                false => (1.0 - SETTING_SHARE) / others,
            };
            RowOdds::Share(of_action / f64::from(rows[row.action]))
        };
        self.rows().iter().map(share).collect()
    }

    /// One offer for each row. Every row draws from its own stream, so that one row's draws do not change another's.
    pub fn offers(&self, situation: &Situation<'_>) -> Vec<Offer> {
        self.offers_at(situation, &[])
    }

    /// As [`ActionTable::offers`], but the first try of each row takes its values at `shares` of their ranges, each in
    /// `[0, 1)`, by parameter of the row. Parameters without a share, and every further try, are drawn by chance.
    pub fn offers_at(&self, situation: &Situation<'_>, shares: &[f64]) -> Vec<Offer> {
        let kept = situation.surroundings.for_many();
        let surroundings = kept.as_deref().unwrap_or(situation.surroundings);
        let situation = Situation { surroundings, ..*situation };
        (0..self.rows().len()).map(|row| self.offer_at(&situation, row, shares)).collect()
    }

    /// The offer of one row: the same as in [`ActionTable::offers`].
    pub fn offer(&self, situation: &Situation<'_>, row: usize) -> Offer {
        self.offer_at(situation, row, &[])
    }

    /// The offer of one row: the same as in [`ActionTable::offers_at`].
    pub fn offer_at(&self, situation: &Situation<'_>, row: usize, shares: &[f64]) -> Offer {
        Judge::new(&self.space, situation, row).draw(shares)
    }

    /// The result of a step without an action: the effects on the world, and the memory after it.
    pub fn wait(&self, situation: &Situation<'_>) -> (Vec<Effect>, Memory) {
        let Situation { memory, road, rules, step, .. } = *situation;
        let bearers = || self.space.bearers_of_each_step();
        let world = self.space.each_step_asks_the_world().then(|| world_facts(situation, bearers()));
        let after = self.space.memory_after_wait(memory, step, Some(&road.facts), world.as_ref(), rules);
        (Effect::of_change(&self.space, memory, &after), after)
    }

    /// A draw in which some values are given, and the others drawn beside them. If the given ones are not legal so, they are moved: to the
    /// legal ones nearest to them and to a draw of the row.
    ///
    /// # Errors
    /// The most frequent refusal.
    pub fn offer_with(&self, situation: &Situation<'_>, row: usize, given: &[(Arc<str>, Value)]) -> Offer {
        let judge = Judge::new(&self.space, situation, row);
        let is_within = |(name, value): &(Arc<str>, Value)| {
            let action = &self.space.actions[self.space.rows[row].action];
            action.drawn().any(|parameter| parameter.name == *name && parameter.domain.holds(*value))
        };
        if given.iter().all(is_within)
            && let Ok(draw) = judge.draw_beside(given, &[])
        {
            return Ok(draw);
        }
        let drawn = judge.draw(&[])?;
        let value = |name: &Arc<str>| given.iter().find(|(known, _)| known == name).map(|(_, value)| *value);
        let wanted: Vec<(Arc<str>, Value)> =
            drawn.values.iter().map(|(name, own)| (name.clone(), value(name).unwrap_or(*own))).collect();
        judge
            .nearest(&wanted)
            .map_err(|refusals| refusals.into_iter().next().expect("a refusal has a reason"))
    }

    /// The draw with the legal values nearest to given ones. A number that a rule sets is computed from the
    /// others; a number out of bounds moves to the bound.
    ///
    /// # Errors
    /// As [`ActionTable::check`].
    pub fn nearest(
        &self,
        situation: &Situation<'_>,
        row: usize,
        values: &[(Arc<str>, Value)],
    ) -> Result<Draw, Vec<Refusal>> {
        Judge::new(&self.space, situation, row).nearest(values)
    }

    /// Judges given values by the same rules as drawing. Replays use it.
    ///
    /// # Errors
    /// Every rule that refuses, and every value that is missing, unknown or out of range.
    pub fn check(
        &self,
        situation: &Situation<'_>,
        row: usize,
        values: &[(Arc<str>, Value)],
    ) -> Result<Draw, Vec<Refusal>> {
        Judge::new(&self.space, situation, row).check(values)
    }
}

/// Facts of the moment at which a step begins, with those of these named road users.
fn world_facts(situation: &Situation<'_>, bearers: impl Iterator<Item = usize>) -> WorldFacts {
    let Situation { surroundings, step, .. } = *situation;
    let bearers = bearers.filter_map(|who| Some((who, surroundings.bearer(who)?))).collect();
    WorldFacts {
        moment: surroundings.moment(),
        step,
        bearers,
        happened_s: situation.happened_s.to_vec(),
        ..WorldFacts::default()
    }
}
