//! The questions that drawing asks a world: the facts of its moment, and where spawns would be put.

use std::cell::OnceCell;

use crate::action::{LightRequest, OrderRequest, SpawnFacts, SpawnRequest, Surroundings};
use crate::place;
use crate::place::arrival::Arrivals;
use crate::state::time::DT_S;
use crate::state::world::World;
use avastra_lang::model::{MomentFacts, NpcFacts};

/// A moment of a world, with what several questions about it have in common.
struct Survey<'a> {
    world: &'a World,
    arrivals: Arrivals,
    moment: OnceCell<MomentFacts>,
}

impl World {
    fn at_this_moment(&self) -> Survey<'_> {
        Survey { world: self, arrivals: Arrivals::default(), moment: OnceCell::new() }
    }
}

impl Surroundings for World {
    fn survey(&self, request: &SpawnRequest) -> Result<SpawnFacts, String> {
        self.at_this_moment().survey(request)
    }

    fn moment(&self) -> MomentFacts {
        self.moment_facts()
    }

    fn for_many(&self) -> Option<Box<dyn Surroundings + '_>> {
        Some(Box::new(self.at_this_moment()))
    }

    fn bearer(&self, who: usize) -> Option<NpcFacts> {
        self.bearer_facts(who)
    }

    fn order_refusal(&self, order: &OrderRequest) -> Option<String> {
        self.ordered(order).err()
    }

    fn light_refusal(&self, light: &LightRequest) -> Option<String> {
        self.light_ordered(light).err().map(|reason| format!("cannot order `light`: {reason}"))
    }

    fn weather_refusal(&self) -> Option<String> {
        let left_s = self.weather_tick.saturating_sub(self.ticks) as f64 * DT_S;
        (left_s > 0.0).then(|| format!("this traffic profile keeps the weather for {left_s} s more"))
    }
}

impl Surroundings for Survey<'_> {
    fn survey(&self, request: &SpawnRequest) -> Result<SpawnFacts, String> {
        let _leave = self.world.make_room(request)?;
        let around = self.world.alone();
        let newcomers = place::place(&around, &self.arrivals, request, self.world.next_id)?;
        Ok(place::facts(&around, request, &newcomers))
    }

    fn moment(&self) -> MomentFacts {
        *self.moment.get_or_init(|| self.world.moment_facts())
    }

    fn bearer(&self, who: usize) -> Option<NpcFacts> {
        self.world.bearer_facts(who)
    }

    fn order_refusal(&self, order: &OrderRequest) -> Option<String> {
        self.world.order_refusal(order)
    }

    fn light_refusal(&self, light: &LightRequest) -> Option<String> {
        self.world.light_refusal(light)
    }

    fn weather_refusal(&self) -> Option<String> {
        self.world.weather_refusal()
    }
}
