//! Effects of actions on the world: weather, newcomers, orders, and the manoeuvres that go on from tick to tick.

use std::sync::Arc;

use crate::action::{
    Draw, Effect, GAP_TO_ITSELF, GAP_TO_NOBODY, LaterMoment, LightRequest, OrderRequest, SpawnRequest,
};
use crate::behave::manoeuvre::Advance;
use crate::place;
use crate::place::arrival::Arrivals;
use crate::state::ego::VehicleParameters;
use crate::state::manoeuvre::{PhaseCount, Running};
use crate::state::road_user::{Motion, RoadUser};
use crate::state::sensed::SignalColour;
use crate::state::signals::Colours;
use crate::state::time::DT_S;
use crate::state::world::{Switch, World};
use crate::view::around::View;
use crate::view::moment::npc_facts;
use avastra_lang::model::command::Command;
use avastra_lang::model::vocabulary::Field;
use avastra_lang::model::{COMMANDED_MAX, NpcFacts};
use avastra_road::StopLine;

/// Commanded obstacles at a time. For the next one, the oldest that is out of sight leaves; in the published package the
/// oldest leaves wherever it is.
const OBSTACLES_MAX: usize = COMMANDED_MAX as usize;

impl World {
    /// Carries out a whole draw or nothing of it: its second spawn may find its first in the way. Returns the index of each
    /// effect that made road users appear, with the id of the first of them.
    ///
    /// # Errors
    /// The index of the effect that is impossible, and why; the world is then unchanged.
    pub fn carry_out(&mut self, draw: &Draw) -> Result<Vec<(usize, u32)>, (usize, String)> {
        // One effect alone changes nothing if it is impossible.
        let before = (draw.effects.len() > 1).then(|| self.clone());
        let mut newcomers = Vec::new();
        for (nth, effect) in draw.effects.iter().enumerate() {
            let newcomer = match self.apply(effect) {
                Ok(newcomer) => newcomer,
                Err(reason) => {
                    if let Some(before) = before {
                        *self = before;
                    }
                    return Err((nth, reason));
                }
            };
            newcomers.extend(newcomer.map(|id| (nth, id)));
            let index = match (newcomer, effect) {
                (Some(id), _) => self.users.iter().position(|user| user.obstacle.id == id),
                (None, Effect::Order(order)) => self.bearer(order.bearer),
                (None, _) => None,
            };
            let Some(index) = index else { continue };
            let mover = &mut self.users[index].mover;
            let course = draw.course(nth);
            let may_change = match effect {
                Effect::Order(order) => order.command.lane().is_some() || course.is_some(),
                Effect::Time(_) | Effect::Sky(..) | Effect::Spawn(_) | Effect::Light(_) => true,
            };
            if let Some(course) = course {
                let running = Running::new(Arc::clone(course), self.ticks);
                mover.phases = PhaseCount { all: running.phases(), ..PhaseCount::default() };
                mover.course = Some(Box::new(running));
            }
            if let (Some(rules), Motion::Drive(driver), true) =
                (&draw.lane_changes, &mut mover.motion, may_change)
            {
                driver.lane_changes.push(Arc::clone(rules));
            }
        }
        Ok(newcomers)
    }

    /// Carries out an effect.
    ///
    /// # Errors
    /// Why a spawn or an order is impossible; the world is then unchanged. Otherwise the id of the newcomer, if there is
    /// one.
    pub fn apply(&mut self, effect: &Effect) -> Result<Option<u32>, String> {
        match effect {
            Effect::Time(time) => self.environment.time = *time,
            Effect::Sky(phenomenon, level) => self.environment.set(*phenomenon, *level),
            Effect::Spawn(request) => return self.spawn(request).map(Some),
            Effect::Order(order) => return self.order(order).map(|()| None),
            Effect::Light(light) => return self.order_light(light).map(|()| None),
        }
        self.weather_tick = self.ticks + (self.traffic.weather_rest_s / DT_S).round() as u64;
        self.conditions = self.environment.conditions(self.ego.motion.speed_mps);
        Ok(None)
    }

    pub(super) fn spawn(&mut self, request: &SpawnRequest) -> Result<u32, String> {
        let leave = self.make_room(request)?;
        let placed = place::place(&self.alone(), &Arrivals::default(), request, self.next_id)?;
        for index in leave.into_iter().rev() {
            self.users.remove(index);
        }
        let mut asked = placed.asked;
        asked.mover.bearer = request.bearer;
        let id = self.next_id;
        self.next_id += 1 + u32::from(placed.cover.is_some());
        self.users.extend([asked].into_iter().chain(placed.cover));
        self.look();
        Ok(id)
    }

    /// The index of the road user that an order is for.
    ///
    /// # Errors
    /// Why it cannot be ordered, in words that complete "cannot order `NAME`: …".
    pub(super) fn ordered(&self, order: &OrderRequest) -> Result<usize, String> {
        let index = self.bearer(order.bearer).ok_or("no road user of that name is there")?;
        let RoadUser { obstacle, mover } = &self.users[index];
        if mover.is_wreck() {
            return Err("it is a wreck".to_owned());
        }
        if let Some(reason) = order.impossible(obstacle.verb) {
            return Err(reason);
        }
        match order.command.to().map(|who| self.bearer_id(who)) {
            Some(None) => return Err(GAP_TO_NOBODY.to_owned()),
            Some(Some(id)) if id == obstacle.id => return Err(GAP_TO_ITSELF.to_owned()),
            Some(Some(_)) | None => {}
        }
        if let Motion::Drive(driver) = &mover.motion {
            let (around, command) = (self.alone(), &order.command);
            let ignores = command.ignores().unwrap_or(driver.ignores);
            let side =
                command.lane().map(|lane| driver.side_of(lane, obstacle, ignores, &around)).transpose()?;
            // One that is to change its lane will turn from another one.
            if let (Some(to), None) = (command.turn(), side.flatten()) {
                driver.can_turn(to, &around, &mover.size)?;
            }
            let view = View { this: obstacle, size: &mover.size, around: &around };
            if command.early_s().is_some() && command.at_m().is_some_and(|at_m| driver.is_past(&view, at_m)) {
                return Err("it is past that place already".to_owned());
            }
            let crosses = || {
                driver.ways_to_crossing(mover.size.length_m, &around).is_some_and(|(_, ego_m)| ego_m > 0.0)
            };
            if command.early_s().is_some()
                && command.at_m().is_none()
                && command.turn().is_none()
                && !crosses()
            {
                return Err("its way does not cross the ego vehicle's ahead of it".to_owned());
            }
        }
        Ok(index)
    }

    fn order(&mut self, order: &OrderRequest) -> Result<(), String> {
        let index = self.ordered(order)?;
        let to = order.command.to().and_then(|who| self.bearer_id(who));
        let mover = &mut self.users[index].mover;
        // The phases that are left of a manoeuvre are dropped.
        mover.course = None;
        mover.motion.order(&order.command, to, self.ticks);
        self.show(index, &order.command);
        Ok(())
    }

    /// The ego vehicle's next traffic light and the station of its line, if an order can be about it.
    ///
    /// # Errors
    /// Why it cannot, in words that complete "cannot order `light`: …".
    pub(super) fn light_ordered(&self, light: &LightRequest) -> Result<StopLine, String> {
        let front_m = VehicleParameters::MKZ.front_m(self.ego_station_m);
        let ahead = |line: &&StopLine| line.station_m >= self.ego_station_m;
        let line = self.scene.route.stop_lines.iter().find(ahead).ok_or("no traffic light is ahead")?;
        match light.at_m {
            Some(at_m) if line.station_m - front_m < at_m => Err("the ego vehicle is nearer already".into()),
            Some(_) | None => Ok(*line),
        }
    }

    fn order_light(&mut self, light: &LightRequest) -> Result<(), String> {
        let StopLine { signal, station_m, .. } = self.light_ordered(light)?;
        // Infinitely far before its line it is at once.
        let at_m = station_m - light.at_m.unwrap_or(f64::INFINITY);
        self.switch = Some(Switch { signal, colour: light.colour, at_m });
        self.switch_light();
        Ok(())
    }

    /// Lets a light show what it was told to, once the ego vehicle's front is there. Until then it goes on as it does, but a
    /// green one waits with its change.
    pub(super) fn switch_light(&mut self) {
        let Some(Switch { signal, colour, at_m }) = self.switch else { return };
        let (map, tick, before) = (&self.scene.map, self.ticks, self.signals);
        let from = if VehicleParameters::MKZ.front_m(self.ego_station_m) >= at_m {
            self.signals.jump(map, signal, tick, colour);
            self.switch = None;
            tick
        } else if self.signals.colour(map, signal, tick) == SignalColour::Green {
            self.signals.stay(map, signal, tick + 1);
            tick + 1
        } else {
            return;
        };
        if self.signals != before {
            self.colours = Colours::at(&self.signals, &self.scene.map, self.ticks);
            self.signals_until.push((from, before));
        }
    }

    /// A vehicle shows the lights that it is told to.
    fn show(&mut self, index: usize, command: &Command) {
        let lights = &mut self.users[index].obstacle.lights;
        *lights = command.lights().unwrap_or(*lights);
    }

    /// Moves on the manoeuvres of road users, whose phases tell them what to do.
    pub(super) fn direct(&mut self) {
        let has_course = |user: &RoadUser| user.mover.course.is_some();
        if !self.users.iter().any(has_course) {
            return;
        }
        let moment = self.moment_facts();
        for index in 0..self.users.len() {
            let Some(running) = self.users[index].mover.course.take() else { continue };
            let RoadUser { obstacle, mover } = &self.users[index];
            if mover.is_wreck() {
                continue;
            }
            let Some(progress) = mover.motion.progress(&self.alone()) else { continue };
            let speed_mps = match &mover.motion {
                Motion::Drive(driver) => driver.speed_mps,
                Motion::Guide(guided) => guided.speed_mps,
                Motion::Walk(_) | Motion::Stroll(_) | Motion::Stand => obstacle.velocity_mps.norm(),
            };
            let npc = NpcFacts { speed_mps, ..npc_facts(&self.alone(), obstacle, &mover.motion) };
            let facts = |who: usize| Some((who, self.bearer_facts(who)?));
            let bearers = running.bearers().into_iter().filter_map(facts).collect();
            let moment = LaterMoment { moment, npc, bearers };
            let Advance { rest, command, begun, ended, hands_over } =
                running.advance(&moment, progress, self.ticks);
            let mover = &mut self.users[index].mover;
            mover.phases.begun += begun;
            mover.phases.ended += ended;
            if let Some(next) = rest.as_ref().filter(|_| hands_over) {
                mover.phases.all = mover.phases.begun + next.phases();
            }
            let tracked = rest.as_ref().and_then(|rest| rest.tracked(&moment, progress.moves));
            // The command of a phase may leave the speed to an earlier phase.
            let command = match (command, tracked) {
                (Some(mut command), Some(tracked)) if !command.says(Field::Speed) => {
                    for field in [Field::Speed, Field::Rate] {
                        command.set(field, tracked.get(field).copied());
                    }
                    Some(command)
                }
                (command, tracked) => command.or(tracked),
            };
            mover.course = rest.map(Box::new);
            let Some(command) = command else { continue };
            let to =
                command.to().map(|who| self.bearer_id(who).filter(|id| *id != self.users[index].obstacle.id));
            let mover = &mut self.users[index].mover;
            match to {
                // The command has no value while the road user to which it keeps a gap is absent.
                Some(None) => mover.course = None,
                to => {
                    mover.motion.order(&command, to.flatten(), self.ticks);
                    self.show(index, &command);
                }
            }
        }
    }

    /// Indices of the commanded obstacles that leave for new ones, if there are as many as there may be.
    pub(super) fn make_room(&self, request: &SpawnRequest) -> Result<Vec<usize>, String> {
        let commanded = self.users.iter().enumerate().filter(|(_, user)| !user.obstacle.is_ambient());
        let wanted = commanded.clone().count() + Effect::Spawn(*request).newcomers() as usize;
        let too_many = wanted.saturating_sub(OBSTACLES_MAX);
        let around = self.alone();
        let is_hidden = |user: &RoadUser| {
            self.traffic.oldest_leaves_in_sight
                || !around.is_in_sight(&user.obstacle, user.mover.visible_fraction)
        };
        // A road user with a name is still wanted.
        let is_spare = |user: &RoadUser| user.mover.bearer.is_none() && is_hidden(user);
        let hidden = commanded.filter(|(_, user)| too_many > 0 && is_spare(user));
        let oldest: Vec<usize> = hidden.take(too_many).map(|(index, _)| index).collect();
        if oldest.len() < too_many { Err("ten road users are there already".into()) } else { Ok(oldest) }
    }
}
