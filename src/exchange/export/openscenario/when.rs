//! The conditions that a phase waits for, as conditions of OpenSCENARIO: comparisons whose sides are sums of the compared
//! facts.
//!
//! A distance has a sign in avastra, and none in OpenSCENARIO. So less than a gap is written for a first phase alone,
//! which comes when the gap first closes. More than a gap is written where both orders of the two are asked for.

use avastra_lang::model::NpcFacts;
use avastra_lang::model::expr::{Arithmetic, Comparison, Expr, ExprKind};
use avastra_lang::model::vocabulary::Fact;
use avastra_world::action::Course;
use avastra_world::sim::VehicleParameters;

use super::super::xml::Element;
use super::actions::{by_entity, by_value};
use super::entity::ahead_of_centre_m;
use super::story::Cast;

/// Smaller coefficients count as 0.
const NOTHING: f64 = 1e-9;

/// Tolerance for taking a distance of outlines as one of reference points, m.
const POINTS_M: f64 = 0.01;

/// Conditions and groups of an event: no more are read back.
const CONDITIONS_MAX: usize = 16;

/// Groups of conditions, of which one must hold, each as what stands in a `Condition`.
pub type Groups = Vec<Vec<Element>>;

/// The conditions that a road user waits for in a phase. `own` is its place among the players of the cast.
///
/// # Errors
/// The condition that has no counterpart, in words.
pub fn groups(cast: &Cast, own: usize, course: &Course, phase: usize, expr: &Expr) -> Result<Groups, String> {
    let waiting = Waiting { cast, own, course };
    let groups = waiting.groups(expr)?;
    let asks_for_less = |group: &&Vec<Element>| group.iter().any(|condition| is_of(condition, "lessOrEqual"));
    if groups.iter().filter(asks_for_less).any(|group| phase > 0 || group.len() > 1) {
        return Err("a gap that closes is waited for later, or with other conditions".to_owned());
    }
    Ok(groups)
}

/// Whether a condition compares a distance of two by this rule.
fn is_of(condition: &Element, rule: &str) -> bool {
    let is_distance = matches!(condition.name(), "RelativeDistanceCondition" | "TimeHeadwayCondition");
    is_distance && condition.attribute("rule") == Some(rule)
        || condition.children().iter().any(|child| is_of(child, rule))
}

#[derive(Clone, Copy, PartialEq)]
enum Who {
    Ego,
    /// A place among the players.
    Newcomer(usize),
}

/// A fact of a road user, with its coefficient.
#[derive(Clone, Copy, PartialEq)]
struct Part {
    /// The ego vehicle, if the fact is about no road user.
    who: Who,
    fact: Fact,
    factor: f64,
}

struct Sum {
    parts: Vec<Part>,
    constant: f64,
}

/// One is so far ahead of another: the gap between them, less what is compared with it.
struct Gap {
    ahead: Who,
    behind: Who,
    /// m.
    bound_m: f64,
    /// Is multiplied by the speed of the road user behind, s.
    bound_s: Option<f64>,
    is_more: bool,
}

struct Waiting<'a> {
    cast: &'a Cast<'a>,
    own: usize,
    course: &'a Course,
}

impl Waiting<'_> {
    fn groups(&self, expr: &Expr) -> Result<Groups, String> {
        match &expr.kind {
            ExprKind::And(a, b) => {
                let (a, b) = (self.groups(a)?, self.groups(b)?);
                let conditions = a.iter().map(Vec::len).sum::<usize>() * b.len()
                    + b.iter().map(Vec::len).sum::<usize>() * a.len();
                if conditions > CONDITIONS_MAX {
                    return Err(too_many());
                }
                Ok(a.iter().flat_map(|a| b.iter().map(|b| [a.clone(), b.clone()].concat())).collect())
            }
            ExprKind::Or(a, b) => {
                if let Some(apart) = self.apart(a, b)? {
                    return Ok(vec![vec![apart]]);
                }
                let both = [self.groups(a)?, self.groups(b)?].concat();
                let is_many = both.iter().map(Vec::len).sum::<usize>() > CONDITIONS_MAX;
                if is_many { Err(too_many()) } else { Ok(both) }
            }
            ExprKind::Compare(how, a, b) => {
                let sum = self.difference(a, b).ok_or_else(unknown)?;
                Ok(vec![vec![self.compared(sum, *how)?]])
            }
            _ => Err(unknown()),
        }
    }

    /// Two are farther apart than something, whichever of them is ahead.
    fn apart(&self, a: &Expr, b: &Expr) -> Result<Option<Element>, String> {
        let gap = |expr: &Expr| match &expr.kind {
            ExprKind::Compare(how, a, b) => self.gap(self.difference(a, b)?, *how),
            _ => None,
        };
        let (Some(one), Some(other)) = (gap(a), gap(b)) else { return Ok(None) };
        let is_turned = one.ahead == other.behind && one.behind == other.ahead;
        let has_same_bound =
            near(one.bound_m, other.bound_m) && one.bound_s.is_none() && other.bound_s.is_none();
        if !(is_turned && has_same_bound && one.is_more && other.is_more) {
            return Ok(None);
        }
        self.distance(&one).map(Some)
    }

    fn difference(&self, a: &Expr, b: &Expr) -> Option<Sum> {
        Some(self.sum(a)?.and(self.sum(b)?, -1.0))
    }

    fn sum(&self, expr: &Expr) -> Option<Sum> {
        if let Some(value) = self.course.constant(expr) {
            return Some(Sum { parts: Vec::new(), constant: value.number() });
        }
        let part = |who, fact| Some(Sum { parts: vec![Part { who, fact, factor: 1.0 }], constant: 0.0 });
        match &expr.kind {
            ExprKind::Fact(fact @ (Fact::EgoSpeed | Fact::EgoFront | Fact::EgoRear | Fact::Elapsed)) => {
                part(Who::Ego, *fact)
            }
            ExprKind::Fact(fact) => part(Who::Newcomer(self.own), *fact),
            ExprKind::OfBearer(who, fact) => {
                let bearer = self.course.bearer(*who);
                let found =
                    self.cast.newcomers.iter().position(|other| other.request.bearer == Some(bearer))?;
                part(Who::Newcomer(found), *fact)
            }
            ExprKind::Negate(inner) => Some(self.sum(inner)?.times(-1.0)),
            ExprKind::Arithmetic(Arithmetic::Add, a, b) => Some(self.sum(a)?.and(self.sum(b)?, 1.0)),
            ExprKind::Arithmetic(Arithmetic::Subtract, a, b) => self.difference(a, b),
            ExprKind::Arithmetic(Arithmetic::Multiply, a, b) => {
                match (self.course.constant(a), self.course.constant(b)) {
                    (Some(factor), _) => Some(self.sum(b)?.times(factor.number())),
                    (None, Some(factor)) => Some(self.sum(a)?.times(factor.number())),
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
        let first = sum.parts.first().copied().ok_or_else(unknown)?;
        if let Some(gap) = self.gap(Sum { parts: sum.parts.clone(), ..sum }, how) {
            let reason = "a phase waits until a gap has opened, which may be on either side of the other one";
            return if gap.is_more { Err(reason.to_owned()) } else { self.distance(&gap) };
        }
        let is_more = is_more(how).ok_or_else(unknown)? == (first.factor > 0.0);
        let sum = sum.times(1.0 / first.factor);
        let (bound, rule) = (-sum.constant, rule_of(is_more));
        match sum.parts.as_slice() {
            [Part { fact: Fact::Elapsed, .. }] if is_more => {
                let time =
                    Element::new("SimulationTimeCondition").with("rule", rule).measured("value", bound);
                Ok(by_value(time))
            }
            [one] if is_speed(one) => {
                let speed = Element::new("SpeedCondition").with("rule", rule).measured("value", bound);
                Ok(by_entity(self.name(one.who), speed))
            }
            [one, other] if is_speed(one) && is_speed(other) && near(other.factor, -1.0) => {
                let speed = Element::new("RelativeSpeedCondition")
                    .with("entityRef", self.name(other.who))
                    .with("rule", rule)
                    .measured("value", bound);
                Ok(by_entity(self.name(one.who), speed))
            }
            [one @ Part { fact: Fact::EgoFront | Fact::NpcStation, .. }] if is_more => {
                let begins_m = match one.who {
                    Who::Ego => self.cast.ego_front_m,
                    Who::Newcomer(at) => self.cast.newcomers[at].begins_m(),
                };
                let way_m = (bound - begins_m).max(0.0);
                let way = Element::new("TraveledDistanceCondition").measured("value", way_m);
                Ok(by_entity(self.name(one.who), way))
            }
            _ => Err(unknown()),
        }
    }

    /// A sum that is the gap between two, less a length, and a time at the speed of the one behind; `None` if it is none.
    fn gap(&self, sum: Sum, how: Comparison) -> Option<Gap> {
        let is_more = is_more(how)?;
        let find = |facts: [Fact; 2]| sum.parts.iter().copied().find(|part| facts.contains(&part.fact));
        let ahead = find([Fact::NpcRear, Fact::EgoRear])?;
        let behind = find([Fact::NpcFront, Fact::EgoFront])?;
        if !near(behind.factor, -ahead.factor) {
            return None;
        }
        let scaled = sum.times(1.0 / ahead.factor);
        let is_end = |part: &&Part| {
            matches!(part.fact, Fact::NpcRear | Fact::EgoRear | Fact::NpcFront | Fact::EgoFront)
        };
        let rest: Vec<&Part> = scaled.parts.iter().filter(|part| !is_end(part)).collect();
        let bound_s = match rest.as_slice() {
            [] => None,
            [speed] if is_speed(speed) && speed.who == behind.who && scaled.parts.len() == 3 => {
                Some(-speed.factor)
            }
            _ => return None,
        };
        (bound_s.is_some() || scaled.parts.len() == 2).then_some(Gap {
            ahead: ahead.who,
            behind: behind.who,
            bound_m: -scaled.constant,
            bound_s,
            is_more: is_more == (ahead.factor > 0.0),
        })
    }

    /// The way between two, compared with a length, or with the way that the one behind drives in a time.
    fn distance(&self, gap: &Gap) -> Result<Element, String> {
        let rear_m = self.end_m(gap.ahead, |facts| facts.rear_m, VehicleParameters::MKZ.length_m);
        let front_m = self.end_m(gap.behind, |facts| facts.front_m, 0.0);
        if rear_m < front_m {
            return Err("a phase waits for a gap to one that is not ahead at the start".to_owned());
        }
        // Between the outlines, or between the reference points, where that is what the sum says.
        let points_m = gap.bound_m + self.overhang_m(gap.ahead, false) + self.overhang_m(gap.behind, true);
        let of_both = |element: Element, is_free_space: bool| {
            element
                .with("entityRef", self.name(gap.ahead))
                .with("freespace", is_free_space)
                .with("coordinateSystem", "road")
                .with("relativeDistanceType", "longitudinal")
                .with("rule", rule_of(gap.is_more))
        };
        let element = match gap.bound_s {
            None if gap.bound_m >= 0.0 => {
                of_both(Element::new("RelativeDistanceCondition"), true).measured("value", gap.bound_m)
            }
            None if points_m >= 0.0 => {
                of_both(Element::new("RelativeDistanceCondition"), false).measured("value", points_m)
            }
            Some(time_s) if time_s >= 0.0 && near(gap.bound_m, 0.0) => {
                of_both(Element::new("TimeHeadwayCondition"), true).measured("value", time_s)
            }
            Some(time_s) if time_s >= 0.0 && points_m.abs() < POINTS_M => {
                of_both(Element::new("TimeHeadwayCondition"), false).measured("value", time_s)
            }
            _ => return Err(unknown()),
        };
        Ok(by_entity(self.name(gap.behind), element))
    }

    /// The station of a road user's end on the ego vehicle's route at the start, m. The ego vehicle's end lies
    /// `behind_front_m` behind its front.
    fn end_m(&self, who: Who, of: fn(&NpcFacts) -> f64, behind_front_m: f64) -> f64 {
        match who {
            Who::Ego => self.cast.ego_front_m - behind_front_m,
            Who::Newcomer(at) => of(&self.cast.newcomers[at].facts),
        }
    }

    /// How far an end of a road user along the ego vehicle's route lies from the reference point that the file has, m.
    fn overhang_m(&self, who: Who, is_front: bool) -> f64 {
        let (length_m, ahead_m) = match who {
            Who::Ego => (VehicleParameters::MKZ.length_m, -VehicleParameters::MKZ.rear_axle_to_centre_m()),
            Who::Newcomer(at) => {
                let actor = self.cast.newcomers[at].actor;
                let ahead_m = ahead_of_centre_m(actor);
                (actor.shape.length_m, if self.cast.looks_ahead(actor) { ahead_m } else { -ahead_m })
            }
        };
        length_m / 2.0 + if is_front { -ahead_m } else { ahead_m }
    }

    fn name(&self, who: Who) -> &str {
        match who {
            Who::Ego => "ego",
            Who::Newcomer(at) => &self.cast.newcomers[at].name,
        }
    }
}

impl Sum {
    fn times(mut self, factor: f64) -> Sum {
        self.constant *= factor;
        for part in &mut self.parts {
            part.factor *= factor;
        }
        self
    }

    /// With so many times another one.
    fn and(mut self, other: Sum, factor: f64) -> Sum {
        let other = other.times(factor);
        self.constant += other.constant;
        for part in other.parts {
            let is_same = |known: &&mut Part| known.fact == part.fact && known.who == part.who;
            match self.parts.iter_mut().find(is_same) {
                Some(known) => known.factor += part.factor,
                None => self.parts.push(part),
            }
        }
        self.parts.retain(|part| part.factor.abs() > NOTHING);
        self
    }
}

fn is_speed(part: &Part) -> bool {
    matches!(part.fact, Fact::EgoSpeed | Fact::NpcSpeed)
}

/// Whether a comparison with 0 asks for more.
fn is_more(how: Comparison) -> Option<bool> {
    match how {
        Comparison::Greater | Comparison::GreaterEqual => Some(true),
        Comparison::Less | Comparison::LessEqual => Some(false),
        Comparison::Equal | Comparison::NotEqual => None,
    }
}

fn rule_of(is_more: bool) -> &'static str {
    if is_more { "greaterOrEqual" } else { "lessOrEqual" }
}

fn near(value: f64, wanted: f64) -> bool {
    (value - wanted).abs() < NOTHING
}

fn unknown() -> String {
    "a phase waits for what OpenSCENARIO has no condition for".to_owned()
}

fn too_many() -> String {
    format!("a phase waits for more than {CONDITIONS_MAX} conditions")
}
