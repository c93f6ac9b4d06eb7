//! What a phase waits for, as conditions of OpenSCENARIO: comparisons whose sides are sums of what its conditions compare.

use avastra_lang::model::NpcFacts;
use avastra_lang::model::expr::{Arithmetic, Comparison, Expr, ExprKind};
use avastra_lang::model::vocabulary::Fact;
use avastra_world::action::Course;
use avastra_world::sim::VehicleParameters;

use super::super::xml::Element;
use super::actions::{by_entity, by_value};
use super::entity::ahead_of_centre_m;
use super::story::{Cast, Player};

/// Parts of a sum that are smaller are none.
const NOTHING: f64 = 1e-9;

/// A distance of outlines that is so near to that of the reference points is meant as that, m.
const POINTS_M: f64 = 0.01;

/// Groups of conditions, of which one must hold, each as what stands in a `Condition`.
type Groups = Vec<Vec<Element>>;

/// Somebody, and what is asked of it.
#[derive(Clone, Copy, PartialEq)]
struct Part {
    /// A place among the players; `None` is the ego vehicle, or nobody.
    who: Option<usize>,
    fact: Fact,
    times: f64,
}

/// Parts, and a number.
struct Sum {
    parts: Vec<Part>,
    more: f64,
}

/// What somebody waits for in a phase.
///
/// # Errors
/// What has no counterpart, in words.
pub fn groups(cast: &Cast, own: &Player, course: &Course, expr: &Expr) -> Result<Groups, String> {
    let own = cast.players.iter().position(|player| player.name == own.name);
    Waiting { cast, own, course }.groups(expr)
}

struct Waiting<'a> {
    cast: &'a Cast<'a>,
    own: Option<usize>,
    course: &'a Course,
}

impl Waiting<'_> {
    fn groups(&self, expr: &Expr) -> Result<Groups, String> {
        match &expr.kind {
            ExprKind::And(a, b) => {
                let (a, b) = (self.groups(a)?, self.groups(b)?);
                Ok(a.iter().flat_map(|a| b.iter().map(|b| [a.clone(), b.clone()].concat())).collect())
            }
            ExprKind::Or(a, b) => Ok([self.groups(a)?, self.groups(b)?].concat()),
            ExprKind::Compare(how, a, b) => {
                let (Some(a), Some(b)) = (self.sum(a), self.sum(b)) else { return Err(unknown()) };
                Ok(vec![vec![self.compared(a.and(b, -1.0), *how)?]])
            }
            _ => Err(unknown()),
        }
    }

    fn sum(&self, expr: &Expr) -> Option<Sum> {
        if let Some(value) = self.course.constant(expr) {
            return Some(Sum { parts: Vec::new(), more: value.number() });
        }
        let part = |who, fact| Some(Sum { parts: vec![Part { who, fact, times: 1.0 }], more: 0.0 });
        match &expr.kind {
            ExprKind::Fact(fact @ (Fact::EgoSpeed | Fact::EgoFront | Fact::EgoRear | Fact::Elapsed)) => {
                part(None, *fact)
            }
            ExprKind::Fact(fact) => part(self.own, *fact),
            ExprKind::OfBearer(who, fact) => {
                let bearer = self.course.bearer(*who);
                let found =
                    self.cast.players.iter().position(|other| other.request.bearer == Some(bearer))?;
                part(Some(found), *fact)
            }
            ExprKind::Negate(inner) => Some(self.sum(inner)?.times(-1.0)),
            ExprKind::Arithmetic(Arithmetic::Add, a, b) => Some(self.sum(a)?.and(self.sum(b)?, 1.0)),
            ExprKind::Arithmetic(Arithmetic::Subtract, a, b) => Some(self.sum(a)?.and(self.sum(b)?, -1.0)),
            ExprKind::Arithmetic(Arithmetic::Multiply, a, b) => {
                match (self.course.constant(a), self.course.constant(b)) {
                    (Some(times), _) => Some(self.sum(b)?.times(times.number())),
                    (None, Some(times)) => Some(self.sum(a)?.times(times.number())),
                    (None, None) => None,
                }
            }
            ExprKind::Arithmetic(Arithmetic::Divide, a, b) => {
                Some(self.sum(a)?.times(1.0 / self.course.constant(b)?.number()))
            }
            _ => None,
        }
    }

    /// The condition that a sum is less or more than 0.
    fn compared(&self, sum: Sum, how: Comparison) -> Result<Element, String> {
        // The first part counts once, and what is compared with is on the other side.
        let Some(first) = sum.parts.first().copied() else { return Err(unknown()) };
        let is_more = match how {
            Comparison::Greater | Comparison::GreaterEqual => first.times > 0.0,
            Comparison::Less | Comparison::LessEqual => first.times < 0.0,
            Comparison::Equal | Comparison::NotEqual => return Err(unknown()),
        };
        let sum = sum.times(1.0 / first.times);
        let bound = -sum.more;
        let rule = rule_of(is_more);
        match sum.parts.as_slice() {
            [Part { fact: Fact::Elapsed, .. }] if is_more => {
                let time =
                    Element::new("SimulationTimeCondition").with("rule", rule).measured("value", bound);
                Ok(by_value(time))
            }
            [one @ Part { fact: Fact::EgoSpeed | Fact::NpcSpeed, .. }] => {
                let speed = Element::new("SpeedCondition").with("rule", rule).measured("value", bound);
                Ok(by_entity(self.name(one), speed))
            }
            [
                one @ Part { fact: Fact::EgoSpeed | Fact::NpcSpeed, .. },
                other @ Part { fact: Fact::EgoSpeed | Fact::NpcSpeed, .. },
            ] if is(other.times, -1.0) => {
                let speed = Element::new("RelativeSpeedCondition")
                    .with("entityRef", self.name(other))
                    .with("rule", rule)
                    .measured("value", bound);
                Ok(by_entity(self.name(one), speed))
            }
            [one @ Part { fact: Fact::EgoFront | Fact::NpcStation, .. }] if is_more => {
                let begins_m = one.who.map_or(self.cast.ego_front_m, |who| self.cast.players[who].begins_m());
                let way =
                    Element::new("TraveledDistanceCondition").measured("value", (bound - begins_m).max(0.0));
                Ok(by_entity(self.name(one), way))
            }
            [_, _] | [_, _, _] => self.distance(&sum, is_more),
            _ => Err(unknown()),
        }
    }

    fn name(&self, part: &Part) -> &str {
        part.who.map_or("ego", |who| &self.cast.players[who].name)
    }

    /// How far an end of somebody's outline lies from the reference point that the file has, m.
    fn overhang_m(&self, part: &Part, is_front: bool) -> f64 {
        let (length_m, ahead_m) = match part.who {
            Some(who) => {
                let actor = self.cast.players[who].actor;
                (actor.shape.length_m, ahead_of_centre_m(actor))
            }
            None => (VehicleParameters::MKZ.length_m, -VehicleParameters::MKZ.rear_axle_to_centre_m()),
        };
        length_m / 2.0 + if is_front { -ahead_m } else { ahead_m }
    }

    /// The way between two, compared with a length, or with the way that the one behind drives in a time.
    fn distance(&self, sum: &Sum, is_more: bool) -> Result<Element, String> {
        let find = |facts: [Fact; 2]| sum.parts.iter().find(|part| facts.contains(&part.fact)).copied();
        let (Some(ahead), Some(behind)) =
            (find([Fact::NpcRear, Fact::EgoRear]), find([Fact::NpcFront, Fact::EgoFront]))
        else {
            return Err(unknown());
        };
        let end_m = |part: &Part, of: fn(&NpcFacts) -> f64, ego_m: f64| {
            part.who.map_or(ego_m, |who| of(&self.cast.players[who].facts))
        };
        let gap_m = end_m(&ahead, |facts| facts.rear_m, f64::INFINITY)
            - end_m(&behind, |facts| facts.front_m, self.cast.ego_front_m);
        // A distance has no sign: it is known who is ahead.
        if !is(behind.times, -ahead.times) || !gap_m.is_finite() || gap_m < 0.0 {
            return Err("a phase waits until somebody is ahead".to_owned());
        }
        let rule = rule_of(is_more == (ahead.times > 0.0));
        let rest: Vec<&Part> = sum.parts.iter().filter(|part| **part != ahead && **part != behind).collect();
        let bound = -sum.more * ahead.times;
        // Between the outlines, or between the reference points, where that is what the sum says.
        let points_m = bound + self.overhang_m(&ahead, false) + self.overhang_m(&behind, true);
        let of_both = |element: Element, is_free_space: bool| {
            element
                .with("entityRef", self.name(&ahead))
                .with("freespace", is_free_space)
                .with("coordinateSystem", "road")
                .with("relativeDistanceType", "longitudinal")
                .with("rule", rule)
        };
        match rest.as_slice() {
            [] if bound >= 0.0 || points_m >= 0.0 => {
                let distance = of_both(Element::new("RelativeDistanceCondition"), bound >= 0.0);
                let distance = distance.measured("value", if bound >= 0.0 { bound } else { points_m });
                Ok(by_entity(self.name(&behind), distance))
            }
            [Part { who, fact: Fact::EgoSpeed | Fact::NpcSpeed, times }]
                if *who == behind.who && (is(bound, 0.0) || points_m.abs() < POINTS_M) =>
            {
                let time_s = -times * ahead.times;
                let headway = of_both(Element::new("TimeHeadwayCondition"), is(bound, 0.0));
                Ok(by_entity(self.name(&behind), headway.measured("value", time_s)))
            }
            _ => Err(unknown()),
        }
    }
}

impl Sum {
    fn times(mut self, times: f64) -> Sum {
        self.more *= times;
        for part in &mut self.parts {
            part.times *= times;
        }
        self
    }

    /// With so many times another one.
    fn and(mut self, other: Sum, times: f64) -> Sum {
        let other = other.times(times);
        self.more += other.more;
        for part in other.parts {
            let is_same = |known: &&mut Part| known.fact == part.fact && known.who == part.who;
            match self.parts.iter_mut().find(is_same) {
                Some(known) => known.times += part.times,
                None => self.parts.push(part),
            }
        }
        self.parts.retain(|part| part.times.abs() > NOTHING);
        self
    }
}

fn rule_of(is_more: bool) -> &'static str {
    if is_more { "greaterOrEqual" } else { "lessOrEqual" }
}

fn is(value: f64, wanted: f64) -> bool {
    (value - wanted).abs() < NOTHING
}

fn unknown() -> String {
    "a phase waits for what OpenSCENARIO has no condition for".to_owned()
}
