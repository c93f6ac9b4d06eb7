//! Expressions evaluated after the draw: by a driver before it changes lanes, by a manoeuvre at every tick.

use avastra_lang::model::command::{Command, CommandDef};
use avastra_lang::model::expr::Expr;
use avastra_lang::model::{
    Facts, FnDef, Memory, MomentFacts, NpcFacts, RoadFacts, SpawnFacts, Value, WorldFacts, evaluate,
};

/// The values that an action hands on to later evaluations.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Later {
    pub functions: Vec<FnDef>,
    /// The values of the action, or the arguments of a manoeuvre.
    pub locals: Vec<Value>,
    pub road: Option<RoadFacts>,
    /// How long a step lasts, ms.
    pub step_ms: u64,
}

/// The moment in which it is asked.
#[derive(Debug, Clone, Default)]
pub struct LaterMoment {
    pub moment: MomentFacts,
    /// The road user that is asked about.
    pub npc: NpcFacts,
    /// The named road users that are there, of those that are asked about.
    pub bearers: Vec<(usize, NpcFacts)>,
}

impl Later {
    pub fn value(&self, expr: &Expr, moment: &LaterMoment) -> Value {
        self.at(moment, |facts| evaluate(expr, &self.functions, facts))
    }

    pub fn command(&self, command: &CommandDef, moment: &LaterMoment) -> Command {
        self.at(moment, |facts| command.evaluate(&self.functions, facts))
    }

    fn at<T>(&self, moment: &LaterMoment, ask: impl FnOnce(&Facts<'_>) -> T) -> T {
        let LaterMoment { moment, npc, bearers } = moment;
        let step = (moment.elapsed_s * 1000.0).round() as u64 / self.step_ms.max(1);
        let world = WorldFacts { moment: *moment, step, bearers: bearers.clone(), ..WorldFacts::default() };
        let spawn = SpawnFacts { npc: *npc, ..SpawnFacts::default() };
        // Nothing that is asked later names a state.
        let memory = Memory::default();
        let facts = Facts {
            road: self.road.as_ref(),
            world: Some(&world),
            spawn: Some(spawn),
            ..Facts::new(&self.locals, &memory)
        };
        ask(&facts)
    }
}
