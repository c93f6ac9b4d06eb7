//! How fast speeds change: what vehicles can, and profiles of speeds over time as phases.

use avastra_lang::model::SPAWN_SPEED_MPS;
use avastra_lang::model::field::RATE_MPS2;

use super::action::{Bounds, Dynamics, Headway, Kept, Meeting, Over, Speed, SpeedEntry, Steady};
use super::body::Body;
use super::cast::{Cast, Moving, speed, too_fast};
use super::condition::Waiting;
use super::order::is_speed;
use super::phases::{CONTINUOUS, Told, instead_of};
use super::said::{Piece, Said};
use super::source::{Mark, Source};

/// A shorter wait is none, s.
const LEAST_S: f64 = 1e-4;

/// The fields of an order that set the speed.
pub const PACE: [&str; 7] = ["speed", "rate", "continuous", "early", "at", "reach", "steady"];

/// The stiffness of the spring by which esmini keeps a distance, for each m/s² of the bound, 1/m.
pub const SPRING_PER_M: f64 = 0.4;

/// That law as functions of the language. `too_far`: how far it has to go ahead; `faster`: by how much it is faster than the other one.
pub const KEEPING: &str = "\
fn bounded(value: Accel, gains: Accel, loses: Accel) -> Accel = match value > gains {
  true => gains
  false => match value < -loses { true => -loses, false => value }
}
fn pulled(too_far: Length, faster: Speed, bound: Accel, damping: Ratio) -> Accel =
  too_far * 0.4 * bound / 1 m - faster * damping / 1 s
fn up_to(speed: Speed, most: Speed) -> Speed = match speed > most { true => most, false => speed }
/// The speed a tick later of one that keeps a distance, as the spring does with which esmini keeps it.
fn keeping(
  speed: Speed,
  too_far: Length,
  faster: Speed,
  gains: Accel,
  loses: Accel,
  gains_damping: Ratio,
  loses_damping: Ratio,
  most: Speed,
) -> Speed = match too_far < 0 m {
  true => up_to(speed + bounded(pulled(too_far, faster, gains, gains_damping), gains, loses) * 20 ms, most)
  false => up_to(speed + bounded(pulled(too_far, faster, loses, loses_damping), gains, loses) * 20 ms, most)
}
";

/// A rate of a speed of at most so much, as a player keeps to what a vehicle can, and as an order may have, m/s².
pub fn rate_within_mps2(source: &mut Source, most_mps2: f64, rate_mps2: f64) -> f64 {
    let (least, most) = (*RATE_MPS2.start(), *RATE_MPS2.end());
    let within = rate_mps2.clamp(least, most_mps2.clamp(least, most));
    if rate_mps2 > within {
        source.note(format!("speeds change no faster than the file's vehicles can, nor than {most} m/s^2"));
    } else if rate_mps2 < within {
        source.note(format!("speeds change by {least} m/s^2 at least"));
    }
    within
}

/// Which way a speed changes.
#[derive(Debug, Clone, Copy)]
pub enum Change {
    /// Or not at all.
    Up,
    Down,
    /// The file does not say from which speed.
    Unknown,
}

impl Change {
    pub fn between(from_mps: Option<f64>, to_mps: Option<f64>) -> Change {
        match (from_mps, to_mps) {
            (Some(from), Some(to)) if to < from => Change::Down,
            (Some(_), Some(_)) => Change::Up,
            _ => Change::Unknown,
        }
    }
}

impl<'a> Cast<'a> {
    #[expect(clippy::too_many_arguments, reason = "an action with where it stands and what it changes")]
    pub fn speed_fields(
        &self,
        source: &mut Source,
        moving: &Moving,
        mark: &Mark,
        wanted: &Speed,
        dynamics: Dynamics,
        told: &mut Told,
        fields: &mut Vec<Said>,
    ) -> Option<()> {
        let is_continuous = match wanted {
            Speed::More(name, _) | Speed::Times(name, _) if dynamics.is_continuous => {
                let reason = "a speed that follows itself from moment to moment";
                source.refuse_if(*name == moving.entity.name, mark, reason)?;
                self.is_ego(name) || !self.keeps_its_speed(name)
            }
            _ => false,
        };
        let who = |source: &mut Source, name: &str| self.called(source, mark, moving, name);
        let (said, mps) = match wanted {
            Speed::Absolute(mps) => (Said::default().number(*mps, "m/s"), Some(*mps)),
            Speed::More(name, more) => {
                (Said::text(format!("{}.speed + ", who(source, name)?)).number(*more, "m/s"), None)
            }
            Speed::Times(name, times) => {
                (Said::text(format!("{}.speed * ", who(source, name)?)).number(*times, ""), None)
            }
        };
        let begins_mps = match wanted {
            Speed::Absolute(mps) => *mps,
            Speed::More(name, more_mps) => self.begins_mps(source, mark, name)? + more_mps,
            Speed::Times(name, times) => self.begins_mps(source, mark, name)? * times,
        };
        moving.entity.body.drives(source, mark, begins_mps)?;
        if let Some(mps) = mps {
            source.refuse_if(mps < 0.0, mark, "no road user drives backwards")?;
            source.refuse_if(mps > *SPAWN_SPEED_MPS.end(), mark, too_fast(mps))?;
        }
        if matches!(dynamics.over, Over::Never) {
            source.note("a speed that changes by 0 m/s² stays as it is");
            return Some(());
        }
        if dynamics.peak > 1.0 && !matches!(dynamics.over, Over::AtOnce) {
            source.note("speeds change evenly, also where the file has a curve");
        }
        if told.mps == mps && mps.is_some() && matches!(dynamics.over, Over::Time(_) | Over::Way(_)) {
            source.note("who is to change to the speed that it has is done at once");
        }
        if let (false, Speed::More(name, _) | Speed::Times(name, _)) = (is_continuous, wanted)
            && !matches!(dynamics.over, Over::AtOnce)
            && !self.keeps_its_speed(name)
        {
            source.note("a speed relative to another's is that at the beginning of its change, unless it is `continuous`");
        }
        let rate = rate_of(source, mark, &moving.entity.body, (told.mps, mps, &said), dynamics)?;
        told.mps = mps;
        instead_of(fields, &PACE);
        let follows = Said::text(format!("{CONTINUOUS}, speed: ")).then(said.clone());
        fields.push(Said::text("speed: ").then(said));
        // A rate that is computed holds on the way to the other's speed, and not while that is kept.
        let is_computed = rate.as_ref().is_some_and(|rate| rate.0.len() > 1);
        fields.extend(rate.map(|rate| Said::text("rate: ").then(rate)));
        told.then = (is_continuous && is_computed).then(|| Said::text("{ ").then(follows).and(" }"));
        fields.extend((is_continuous && !is_computed).then(|| Said::text(CONTINUOUS)));
        Some(())
    }

    /// The fields of one that keeps a distance to another, by the law of esmini: a spring that is damped critically, or at once where
    /// nothing bounds it.
    pub fn kept(
        &self,
        source: &mut Source,
        moving: &Moving<'a>,
        mark: &Mark,
        kept: &Kept,
    ) -> Option<Vec<Said>> {
        let (of, too_far) = self.too_far(source, moving, mark, kept)?;
        let Body { gains_mps2, loses_mps2, most_mps, .. } = moving.entity.body;
        let bounds = kept.bounds.map(|own| Bounds {
            gains_mps2: own.gains_mps2.min(gains_mps2),
            loses_mps2: own.loses_mps2.min(loses_mps2),
            speed_mps_max: own.speed_mps_max.min(most_mps),
        });
        let said = match bounds {
            None => {
                source.note("a distance without bounds is taken at 70 m/s at most, backwards at 10 m/s");
                Said::text(format!("{of}.speed + (")).then(too_far).and(") / 20 ms")
            }
            Some(Bounds { gains_mps2, loses_mps2, speed_mps_max }) => {
                let most_mps = speed_mps_max.min(*SPAWN_SPEED_MPS.end());
                let damping = |mps2: f64| 2.0 * (SPRING_PER_M * mps2).sqrt();
                Said::text("keeping(npc.speed, ")
                    .then(too_far)
                    .and(format!(", npc.speed - {of}.speed, "))
                    .number(gains_mps2, "m/s^2")
                    .and(", ")
                    .number(loses_mps2, "m/s^2")
                    .and(", ")
                    .number(damping(gains_mps2), "")
                    .and(", ")
                    .number(damping(loses_mps2), "")
                    .and(", ")
                    .number(most_mps, "m/s")
                    .and(")")
            }
        };
        Some(vec![Said::text("speed: ").then(said), Said::text(CONTINUOUS)])
    }

    /// The station at which an entity begins on its way, m; 0 if it has no way.
    fn begin_m(&self, name: &str) -> f64 {
        self.moving.iter().find(|moving| moving.entity.name == name).map_or(0.0, |moving| moving.at_m)
    }

    /// The name of the one to whom a distance is kept, and how far the vehicle has to go ahead for it.
    pub fn too_far(
        &self,
        source: &mut Source,
        moving: &Moving<'a>,
        mark: &Mark,
        kept: &Kept,
    ) -> Option<(String, Said)> {
        let own = &moving.entity.name;
        source.refuse_if(kept.of == *own, mark, "a distance to itself")?;
        let waiting = Waiting::at_first(self, moving);
        let of = waiting.who(source, mark, &kept.of)?;
        let (here, there) = (self.begins(source, mark, own)?, self.begins(source, mark, &kept.of)?);
        let looks_ahead = self.looks_ahead(source, mark, own)?;
        let is_off = self.is_far_off(source, mark, own)? || self.is_far_off(source, mark, &kept.of)?;
        let faces = !is_off && looks_ahead != self.looks_ahead(source, mark, &kept.of)?;
        source.refuse_if(faces, mark, "a distance is kept by those who drive the same way")?;
        // If two road users come towards the ego vehicle, the one ahead is behind along its route.
        let is_against = !is_off && !looks_ahead;
        let is_ahead = match kept.is_ahead {
            Some(is_ahead) => is_ahead,
            None => {
                source.note("who is ahead where a distance is kept is as at the beginning");
                match self.stations_apart_m(own, &kept.of) {
                    Some((apart_m, _)) => apart_m + self.begin_m(&kept.of) < self.begin_m(own),
                    None => (self.station_m(here) > self.station_m(there)) != is_against,
                }
            }
        };
        let (back, front) = if is_ahead == is_against { (own, &kept.of) } else { (&kept.of, own) };
        let away = waiting.between(source, mark, back, front, kept.is_free_space)?;
        let wanted = match kept.headway {
            Headway::Way(way_m) => Said::default().number(way_m, "m"),
            Headway::Time(time_s) => Said::text(format!("{of}.speed * ")).number(time_s, "s"),
        };
        let too_far = match is_ahead {
            true => wanted.and(" - (").then(away).and(")"),
            false => away.and(" - ").then(wanted),
        };
        Some((of, too_far))
    }

    /// Whether an entity other than the ego vehicle drives at one speed from the beginning on.
    fn keeps_its_speed(&self, name: &str) -> bool {
        let Some(entity) = self.story.entity(name) else { return false };
        let is_timed = entity.way.as_ref().is_some_and(|way| way.timing.is_some());
        !is_timed && !entity.events.iter().flat_map(|event| &event.acts).any(is_speed)
    }

    pub fn meeting_fields(
        &self,
        source: &mut Source,
        moving: &Moving,
        mark: &Mark,
        meeting: &Meeting,
        told: &mut Told,
        fields: &mut Vec<Said>,
    ) -> Option<()> {
        let reason = "only the ego vehicle is met";
        source.refuse_if(!self.is_ego(&meeting.master), mark, reason)?;
        self.stays(source, &meeting.master_at)?;
        self.stays(source, &meeting.own_at)?;
        let ego = &self.story.ego.body;
        let point = self.place(source, &meeting.master_at)?.pose.position;
        // The file says where its reference point is; the language where the front is.
        let ego_m = self.station_m(point) + ego.middle_m + ego.length_m / 2.0;
        let reach_m = moving.reach_m(source, self, &meeting.own_at)?;
        instead_of(fields, &PACE);
        fields.push(Said::text("early: ").number(0.0, "s"));
        fields.push(Said::text("at: ").number(ego_m, "m"));
        fields.push(Said::text("reach: ").number(reach_m, "m"));
        let mps = match &meeting.speed {
            None => {
                source.note("who is to arrive with no speed of the file's drives evenly, from the beginning of its action on");
                None
            }
            Some(Speed::Absolute(mps)) => Some(*mps),
            Some(Speed::More(_, more)) => Some(speed(source, self.story, &self.story.ego, 0)? + more),
            Some(Speed::Times(_, times)) => Some(speed(source, self.story, &self.story.ego, 0)? * times),
        };
        source.note("who arrives with the ego vehicle comes to its place by another course of speeds than in the file's player");
        if let Some(mps) = mps {
            source.refuse_if(mps <= 0.0, mark, "it arrives with a speed above 0")?;
            source.refuse_if(mps > *SPAWN_SPEED_MPS.end(), mark, too_fast(mps))?;
            fields.push(Said::text("speed: ").number(mps, "m/s"));
            let steady_m = match meeting.steady {
                Steady::No => 0.0,
                Steady::Way(way_m) => way_m,
                Steady::Time(time_s) => time_s * mps,
            };
            if steady_m > 0.0 {
                fields.push(Said::text("steady: ").number(steady_m, "m"));
            }
        }
        told.mps = mps;
        Some(())
    }
}

/// The rate of a change of speed, if it takes a time: from what speed, where that is known, to which one, and how that is said. No faster
/// than the vehicle can, where the file says how fast it is before.
fn rate_of(
    source: &mut Source,
    mark: &Mark,
    body: &Body,
    (from_mps, to_mps, said): (Option<f64>, Option<f64>, &Said),
    dynamics: Dynamics,
) -> Option<Option<Said>> {
    let rate = match (dynamics.over, from_mps, to_mps) {
        (Over::AtOnce | Over::Never, ..) => None,
        (Over::Rate(rate), ..) => Some(Said::default().number(rate.abs() / dynamics.peak, "m/s^2")),
        (Over::Time(time_s), Some(from), Some(to)) => {
            (from != to).then(|| Said::default().number((to - from).abs() / time_s, "m/s^2"))
        }
        (Over::Way(way_m), Some(from), Some(to)) => (from != to)
            .then(|| Said::default().number((to * to - from * from).abs() / (2.0 * way_m), "m/s^2")),
        (Over::Time(time_s), ..) => Some(
            Said::text("match npc.speed <= ")
                .then(said.clone())
                .and(" { true => (")
                .then(said.clone())
                .and(" - npc.speed) / ")
                .number(time_s, "s")
                .and(", false => (npc.speed - ")
                .then(Said::text("(").then(said.clone()).and(")"))
                .and(") / ")
                .number(time_s, "s")
                .and(" }"),
        ),
        (Over::Way(_), ..) => {
            return source.refuse(mark, "over a way a speed changes only from one that the file says");
        }
    };
    let change = Change::between(from_mps, to_mps);
    let Body { gains_mps2, loses_mps2, .. } = *body;
    Some(rate.map(|rate| match rate.0.as_slice() {
        [Piece::Number(figure)] => {
            // The peak of a curve is what a vehicle must be able to.
            let mut within = |most_mps2: f64| {
                let mps2 = rate_within_mps2(source, most_mps2 / dynamics.peak, figure.value());
                Said::default().number(mps2, "m/s^2")
            };
            match change {
                Change::Up => within(gains_mps2),
                Change::Down => within(loses_mps2),
                Change::Unknown if figure.value() * dynamics.peak <= gains_mps2.min(loses_mps2) => {
                    within(f64::INFINITY)
                }
                Change::Unknown => Said::text("match npc.speed <= ")
                    .then(said.clone())
                    .and(" { true => ")
                    .then(within(gains_mps2))
                    .and(", false => ")
                    .then(within(loses_mps2))
                    .and(" }"),
            }
        }
        _ => {
            source.note(
                "a change in a time from a speed that the file does not say is as fast as that takes, whatever its vehicle can",
            );
            rate
        }
    }))
}

/// A phase for each entry of a profile, which begins when the one before it has had its time, or has reached its speed if that
/// takes its vehicle longer.
///
/// With them the words before a phase that waits until the last one has had its time.
pub fn profile(
    source: &mut Source,
    mark: &Mark,
    from_mps: Option<f64>,
    entries: &[SpeedEntry],
    begins: Said,
) -> Option<(Vec<Said>, Said)> {
    let (mut from, mut begins, mut phases) = (from_mps, begins, Vec::new());
    for SpeedEntry { mps, time_s } in entries {
        source.refuse_if(*mps < 0.0, mark, "no road user drives backwards")?;
        source.refuse_if(*mps > *SPAWN_SPEED_MPS.end(), mark, too_fast(*mps))?;
        let mut said = begins.and("{ speed: ").number(*mps, "m/s");
        let mut rest_s = *time_s;
        if *time_s > 0.0 {
            let Some(from_mps) = from else {
                return source.refuse(mark, "a profile is read of one whose speed the file says before it");
            };
            let by_mps = (mps - from_mps).abs();
            if by_mps > 0.0 {
                // Its times say how fast, whatever its vehicle can.
                let rate_mps2 = rate_within_mps2(source, f64::INFINITY, by_mps / time_s);
                said = said.and(", rate: ").number(rate_mps2, "m/s^2");
                // One whose vehicle is slower takes longer.
                rest_s = (time_s - by_mps / rate_mps2).max(0.0);
            }
        }
        phases.push(said.and(" }"));
        begins = if rest_s >= LEAST_S {
            Said::text("after ").number(rest_s, "s").and(" ")
        } else {
            Said::default()
        };
        from = Some(*mps);
    }
    Some((phases, begins))
}
