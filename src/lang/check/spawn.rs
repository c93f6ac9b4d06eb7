//! Spawns: road users, rows of them, where they begin and what they do.

use crate::check::checker::Checker;
use crate::check::expression::Place;
use crate::check::mistakes::{Report, as_written, field};
use crate::model::command::{CommandDef, Told};
use crate::model::expr::{Expr, ExprKind};
use crate::model::field::Kind;
use crate::model::vocabulary::{Colour, Field, LaneChoice, Side, Then, Verb, Word};
use crate::model::{BodyWord, EffectDef, InRow, ManoeuvreCall, SpawnDef, Type, WordExpr, code};
use crate::syntax::ast::Span;
use crate::syntax::{Diagnostic, ast, listed};
use avastra_base::units::{Dimension, Rational};

/// A field that means nothing to some verbs.
struct IdleField {
    field: Field,
    is_idle: fn(Verb) -> bool,
    /// Why, of the verb.
    what: &'static str,
    help: &'static str,
}

const fn idle(field: Field, is_idle: fn(Verb) -> bool, what: &'static str, help: &'static str) -> IdleField {
    IdleField { field, is_idle, what, help }
}

/// Fields that mean nothing to some verbs, each for a reason of its own. Any other field is useless to a road user that can
/// never be told it.
const IDLE_FIELDS: [IdleField; 6] = {
    const FOLLOWS: fn(Verb) -> bool = |verb| verb == Verb::Follow;
    const WALKS: fn(Verb) -> bool = |verb| verb == Verb::Walk;
    const NO_WALK: fn(Verb) -> bool = |verb| verb != Verb::Walk;
    const NO_CROSSING: fn(Verb) -> bool = |verb| verb != Verb::CrossRoad;
    use Field::{Early, Lane, Meet, Offset, Side, Waits};
    [
        idle(Lane, FOLLOWS, "begins on its trajectory", "leave `lane` out"),
        idle(Side, FOLLOWS, "begins on its trajectory", "leave `side` out"),
        idle(Offset, WALKS, "begins at the kerb", "leave `offset` out"),
        idle(Meet, NO_WALK, "is met at no point of the ego vehicle", "`meet` is for `Walk`; leave it out"),
        idle(Waits, NO_WALK, "waits at no kerb", "`waits` is for `Walk`; leave it out"),
        idle(
            Early,
            NO_CROSSING,
            "does not meet the ego vehicle at a junction",
            "`early` is for `CrossRoad`, and for manoeuvres; leave it out",
        ),
    ]
};

/// Whether a road user with this verb can never be told this field: `what` and a help in words.
fn never_told(field: Field, verb: Verb) -> Option<(String, String)> {
    let is_checked = matches!(field.kind(), Kind::Own) || IDLE_FIELDS.iter().any(|idle| idle.field == field);
    if is_checked || field == Field::Speed || Told::to(verb).holds(field) {
        return None;
    }
    let name = field.name();
    let why = if verb.is_on_foot() { "it is on foot" } else { "it follows a trajectory" };
    Some((format!("has no use for `{name}`"), format!("leave `{name}` out: {why}")))
}

impl Checker {
    /// Reads one `spawn`: a road user, or several if it is a row.
    pub(super) fn spawns(
        &mut self,
        spawn: &ast::Spawn,
        place: &Place<'_>,
        span: Span,
    ) -> Option<Vec<EffectDef>> {
        let ast::Spawn { bearers, place: begins, of, apart, cover, fields, .. } = spawn;
        let on = begins.trajectory().map(|trajectory| self.trajectory_word(trajectory, place));
        let is_taken = |name: &&ast::Name| place.locals.iter().any(|(local, _)| *local == name.text);
        if let Some(name) = bearers.iter().find(is_taken) {
            let message = format!("`{}` is a parameter, and no new name", name.text);
            let error = Diagnostic::error(code::DUPLICATE, message).at(name.span, "a parameter already");
            self.report(error.help("give what appears a name of its own"));
        }
        let of = of.as_ref().map(|of| self.named_road_user(of, place));
        let cover = cover.as_ref().map(|cover| self.body_word(cover, place));
        let count = self.count_of_row(fields, apart.is_some(), place);
        let apart = apart.as_ref().map(|apart| self.apart(apart, bearers, place));
        let one = self.spawn(spawn, place, span)?;
        let is_on_map = matches!(begins, ast::Place::On(_));
        let ways = on.as_ref().and_then(Option::as_ref).map(|on| (is_on_map, possible(on)));
        self.check_trajectory(on.is_some(), ways, of.is_some(), &one.verb, span);
        let count = count?;
        let (of, cover, trajectory) = (as_written(of)?, as_written(cover)?, as_written(on)?);
        self.check_cover(cover.as_ref(), &one.verb, span);
        if of.is_some() && possible(&one.verb).contains(&Verb::CrossRoad) {
            let message = "`CrossRoad` begins where it meets the ego vehicle in time, beside nobody";
            let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message).at(span, "spawned here");
            self.report(error.help(
                "leave `of` out; several that cross one after the other are a row: `as [first, second] ahead 60 m apart 10 m`",
            ));
        }
        let one = SpawnDef { cover, of, trajectory, ..one };
        let Some(apart) = apart else {
            if let Some(second) = bearers.get(1) {
                let error =
                    Diagnostic::error(code::MISSING_FIELD, "the row does not say how far apart it is");
                let help = "write the gap between them after the distance: `ahead 50 m apart 15 m`";
                return self.reject(error.at(second.span, "another one").help(help));
            }
            let bearer = bearers.first().and_then(|name| self.bearer(name));
            return Some(vec![EffectDef::Spawn(Box::new(SpawnDef { bearer, ..one }))]);
        };
        let apart = apart?;
        let nth = |(nth, name)| {
            let row = || InRow { nth, apart: apart.clone(), count: count.clone(), named: bearers.len() };
            let row = (nth > 0).then(row);
            EffectDef::Spawn(Box::new(SpawnDef { bearer: self.bearer(name), row, ..one.clone() }))
        };
        Some(bearers.iter().enumerate().map(nth).collect())
    }

    /// The place of a name among those of all road users.
    fn bearer(&self, name: &ast::Name) -> Option<usize> {
        self.bearers.iter().position(|one| *one == name.text)
    }

    /// Reports places beside a road user that the same action spawns: it does not exist yet when places are found.
    pub(super) fn check_beside(&mut self, effects: &[ast::Effect]) {
        let spawns = || effects.iter().filter_map(ast::Effect::spawn);
        let own =
            |name: &&ast::Name| spawns().any(|spawn| spawn.bearers.iter().any(|own| own.text == name.text));
        for name in spawns().filter_map(|spawn| spawn.of.as_ref()).filter(own) {
            let message = format!("`{}` appears in the same action", name.text);
            let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message);
            let error = error.at(name.span, "not there yet, or another one");
            self.report(error.help("say both distances from the ego vehicle, or make two actions of it"));
        }
    }

    /// How many of a row appear; `Some(None)` where nothing is said.
    fn count_of_row(
        &mut self,
        fields: &[ast::Field],
        is_row: bool,
        place: &Place<'_>,
    ) -> Option<Option<Expr>> {
        let Some(field) = fields.iter().find(|field| field.name.text == Field::Count.name()) else {
            return Some(None);
        };
        if !is_row {
            let error = Diagnostic::error(code::NOT_HERE, "`count` belongs to a row of several road users");
            let help =
                "name them all, and say how far apart they are: `as [first, second] ahead 50 m apart 15 m`";
            return self.reject(error.at(field.name.span, "there is no row").help(help));
        }
        self.typed(&field.value, place, Type::Int).map(Some)
    }

    /// The gap between the road users of a row, which are named.
    fn apart(&mut self, apart: &ast::Expr, names: &[ast::Name], place: &Place<'_>) -> Option<Expr> {
        let found = self.typed(apart, place, Type::Quantity(Dimension::LENGTH));
        self.once("road user", names.iter());
        if names.len() < 2 {
            let error = Diagnostic::error(code::NOT_HERE, "`apart` belongs to a row of several road users");
            return self
                .reject(error.at(apart.span, "there is only one").help("name them all: `as [last, first]`"));
        }
        found
    }

    /// Reads one road user of `spawn` alone, without its name and the road user it stands beside.
    fn spawn(&mut self, spawn: &ast::Spawn, place: &Place<'_>, span: Span) -> Option<SpawnDef> {
        let ast::Spawn { body, place: begins, distance, of, fields, .. } = spawn;
        let among = Field::of_spawns();
        self.note_fields(fields, &among, place);
        let fields = self.fields_among(fields, &among);
        let find = |wanted: Field| field(&fields, wanted);
        let lacks = |what: &str| format!("the spawn does not say {what}");
        let body_word = self.body_word(body, place);
        let distance = self.typed(distance, place, Type::Quantity(Dimension::LENGTH));
        let verb = match find(Field::Does) {
            Some(value) => self.word::<Verb>("verb", value, place),
            None => self.missing_field(Field::Does, span, lacks("what it does")),
        };
        let verb_words: Vec<Verb> = verb.as_ref().map(possible).unwrap_or_default();
        let needs = |verbs: &[Verb]| verb_words.iter().any(|verb| verbs.contains(verb));
        let lane = match find(Field::Lane) {
            Some(value) => self.word::<LaneChoice>("lane", value, place),
            None if needs(&[Verb::DriveAhead, Verb::DriveBehind, Verb::Overtake]) => {
                self.missing_field(Field::Lane, span, lacks("its lane"))
            }
            None => Some(WordExpr::Fixed(LaneChoice::Current)),
        };
        let side = match find(Field::Side) {
            Some(value) => self.word::<Side>("side", value, place),
            None if needs(&[Verb::CrossRoad, Verb::Walk]) => {
                self.missing_field(Field::Side, span, lacks("where it comes from"))
            }
            None => Some(WordExpr::Fixed(Side::Right)),
        };
        let then = match find(Field::Then) {
            Some(value) => self.then(value, place),
            None => Some((WordExpr::Fixed(Then::Keep), None)),
        };
        let colour = match find(Field::Colour) {
            Some(value) => self.word::<Colour>("colour", value, place),
            None => Some(WordExpr::Fixed(Colour::Black)),
        };
        let speed_type = Type::Quantity(Dimension::SPEED);
        let speed = match find(Field::Speed) {
            Some(value) => self.typed(value, place, speed_type),
            None if verb_words == [Verb::Stand] => {
                Some(Expr { kind: ExprKind::Number(Rational::ZERO), ty: speed_type, span })
            }
            None => self.missing_field(Field::Speed, span, lacks("how fast it is")),
        };
        let is_read = |field: Field| matches!(field, Field::Lane | Field::Speed);
        let others: Vec<_> = fields.iter().copied().filter(|(field, _)| !is_read(*field)).collect();
        let told = self.told_by(&others, place);
        let (body, verb, (then, manoeuvre)) = (body_word?, verb?, then?);
        let behind = begins.is_behind();
        if of.is_none() && begins.trajectory().is_none() {
            self.check_side(&verb, behind, span);
        }
        self.check_verb(&body, &verb, span);
        if let Some(lights) = field(&fields, Field::Lights)
            && let Some(body) = possible(&body).into_iter().find(|body| !body.like.is_vehicle())
            && possible(&verb).contains(&Verb::Follow)
        {
            let message = format!("a `{}` has no lights", self.body_name(body));
            let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message).at(lights.span, "without effect");
            self.report(error.help("leave `lights` out"));
        }
        self.check_fields(&fields, &verb);
        if let Some(given) = &manoeuvre {
            self.check_given(given, &verb, span);
        }
        Some(SpawnDef {
            body,
            colour: colour?,
            verb,
            lane: lane?,
            side: side?,
            then,
            speed: speed?,
            distance: distance?,
            behind,
            of: None,
            trajectory: None,
            cover: None,
            told: told?,
            bearer: None,
            row: None,
            manoeuvre,
            span,
        })
    }

    /// Reports `Follow` without a trajectory, a trajectory with another verb, and a place of the wrong kind for the
    /// trajectory: one on a map takes a station (`at`), one beside the ego vehicle's route a distance (`ahead` or `behind`).
    /// `ways` are the possible trajectories, and whether the place is a station.
    fn check_trajectory(
        &mut self,
        is_on: bool,
        ways: Option<(bool, Vec<usize>)>,
        is_beside: bool,
        verb: &WordExpr<Verb>,
        span: Span,
    ) {
        let (at_station, ways) = ways.unwrap_or_default();
        let other = ways.iter().map(|way| &self.trajectories[*way]);
        let other = other.clone().find(|way| way.is_beside_route() == at_station).map(|way| way.name.clone());
        let odd = possible(verb).into_iter().find(|verb| (*verb == Verb::Follow) != is_on);
        let (message, help) = match (odd, other) {
            (Some(Verb::Follow), _) => (
                "`Follow` needs a trajectory".to_owned(),
                "write where it begins: `on NAME at 12 m`, or `on NAME ahead 40 m` where that lies beside the route",
            ),
            (Some(verb), _) => (
                format!("`{}` does not begin on a trajectory", verb.name()),
                "write `does: Follow`, or `ahead` and a distance",
            ),
            (None, Some(name)) if at_station => (
                format!("`{name}` lies beside the ego vehicle's route, wherever it begins"),
                "say where: `on NAME ahead 40 m`, or `behind`",
            ),
            (None, Some(name)) => (
                format!("`{name}` lies on a map"),
                "say the station at which it begins there, `on NAME at 12 m`, or leave the `road` of the trajectory out",
            ),
            (None, None) if at_station && is_beside => (
                "the place is said twice".to_owned(),
                "leave `of` out: a station on a trajectory is beside nobody",
            ),
            (None, None) => return,
        };
        let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message).at(span, "spawned here");
        self.report(error.help(help));
    }

    /// Reports fields that mean nothing to a verb.
    fn check_fields(&mut self, fields: &[(Field, &ast::Expr)], verb: &WordExpr<Verb>) {
        let verbs = possible(verb);
        let reason = |field: Field, verb: Verb| {
            let idle = IDLE_FIELDS.iter().find(|idle| idle.field == field && (idle.is_idle)(verb));
            let idle = idle.map(|idle| (idle.what.to_owned(), idle.help.to_owned()));
            idle.or_else(|| never_told(field, verb))
        };
        let reason = |field: Field| verbs.iter().find_map(|verb| Some((verb.name(), reason(field, *verb)?)));
        for (field, value) in fields {
            let Some((verb, (what, help))) = reason(*field) else { continue };
            let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, format!("`{verb}` {what}"));
            self.report(error.at(value.span, "without effect").help(help));
        }
        let said = |wanted: Field| field(fields, wanted).filter(|_| reason(wanted).is_none());
        if let (Some(_), Some(waits)) = (said(Field::Meet), said(Field::Waits)) {
            let message = format!("`{}` sets out after a time or for a meeting", Verb::Walk.name());
            let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message).at(waits.span, "both are said");
            self.report(error.help("leave `waits` or `meet` out"));
        }
        self.check_place_fields(fields, &verbs);
    }

    /// Reports a manoeuvre with a field that its road user cannot be told: the first reason alone.
    fn check_given(&mut self, given: &ManoeuvreCall, verb: &WordExpr<Verb>, span: Span) {
        let has = |is_so: fn(&CommandDef) -> bool| self.has_command(given.manoeuvre, is_so);
        let keeps = has(|command| command.says(Field::Keep));
        let keeps_to_ego = has(|command| command.says(Field::Keep) && !command.says(Field::To));
        let changes_lanes = has(|command| command.says(Field::Lane));
        let goes_back = has(CommandDef::goes_back);
        let meets_nowhere = has(|command| command.says(Field::Early) && !command.says(Field::Reach));
        let told = self.told(given.manoeuvre);
        for verb in possible(verb) {
            let is_lacked = told.lacked_by(verb).is_some();
            let other_way = matches!(verb, Verb::DriveOpposite | Verb::CrossRoad);
            let (what, help) = match verb {
                Verb::Stand => (
                    "does no manoeuvre",
                    "leave `then` out, or let it `Walk`, with `speed: 0 m/s` until it is told",
                ),
                Verb::Walk if is_lacked => (
                    "is told a `speed` alone",
                    "the other fields of its manoeuvre are not for who crosses the road; leave them out",
                ),
                _ if is_lacked && verb.is_on_foot() => (
                    "is told a `speed`, an `offset` and an `aside` alone",
                    "the other fields of its manoeuvre are for vehicles; leave them out",
                ),
                Verb::Follow if is_lacked => (
                    "has no driver",
                    "give its manoeuvre a `speed`, `rate`, `offset`, `aside`, `early`, `at`, `reach` and `steady` alone",
                ),
                _ if is_lacked => (
                    "follows no trajectory",
                    "`reach` and `steady` are for `Follow`; leave them out of its manoeuvre",
                ),
                Verb::Follow if meets_nowhere => (
                    "is `early` at a place of its trajectory",
                    "say in its manoeuvre where, `reach: 30 m`, and where the ego vehicle is then, `at: …`",
                ),
                _ if goes_back && !verb.is_on_foot() && verb != Verb::Follow => {
                    ("does not drive backwards", "give its manoeuvre no speed below 0 m/s")
                }
                _ if keeps_to_ego && other_way || keeps && verb == Verb::CrossRoad => (
                    "does not drive in the ego vehicle's direction",
                    "a gap is kept ahead of it or behind it; write `early` in its manoeuvre",
                ),
                _ if other_way && changes_lanes => (
                    "drives in no lane of the ego vehicle's direction",
                    "in its manoeuvre, write `offset` for `lane`",
                ),
                _ => continue,
            };
            let message = format!("`{}` {what}", verb.name());
            let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message).at(span, "spawned here");
            self.report(error.help(help));
            return;
        }
    }

    /// Reports a `lane` and a `side` that mean nothing to any of the verbs.
    fn check_place_fields(&mut self, fields: &[(Field, &ast::Expr)], verbs: &[Verb]) {
        let [ahead, behind, overtake] = [Verb::DriveAhead, Verb::DriveBehind, Verb::Overtake];
        let [cross, walk, stand] = [Verb::CrossRoad, Verb::Walk, Verb::Stand];
        for (wanted, of) in [(Field::Lane, [ahead, behind, overtake]), (Field::Side, [cross, walk, stand])] {
            let Some(value) = field(fields, wanted) else { continue };
            // Another check reports both fields with `Follow`.
            let means_nothing = verbs.iter().all(|verb| !of.contains(verb) && *verb != Verb::Follow);
            if let Some(verb) = verbs.first().filter(|_| means_nothing) {
                let message = format!("a `{}` means nothing to `{}`", wanted.name(), verb.name());
                let error =
                    Diagnostic::error(code::IMPOSSIBLE_SPAWN, message).at(value.span, "without effect");
                let names: Vec<&str> = of.iter().map(|verb| verb.name()).collect();
                self.report(error.help(format!("leave it out; it is for {}", listed(&names))));
            }
        }
    }

    /// The `then` of a spawn: a word, or a manoeuvre.
    fn then(
        &mut self,
        value: &ast::Expr,
        place: &Place<'_>,
    ) -> Option<(WordExpr<Then>, Option<ManoeuvreCall>)> {
        match self.manoeuvre_call(value, place) {
            Some(call) => Some((WordExpr::Fixed(Then::Keep), Some(call?))),
            None if matches!(&value.kind, ast::ExprKind::Name(name) if self.manoeuvre_names.get(name).is_some()) =>
            {
                self.look_at(value, place, None);
                let error = Diagnostic::error(code::TYPE_MISMATCH, "a manoeuvre is given by a call");
                let help = "write what it is given behind its name: `then: brake(4 m/s^2)`, `then: swerve()`";
                self.reject(error.at(value.span, "only its name").help(help))
            }
            None => Some((self.word::<Then>("word for `then`", value, place)?, None)),
        }
    }

    /// Reports a cover that is no vehicle, and one for a road user that does not walk.
    fn check_cover(&mut self, cover: Option<&WordExpr<BodyWord>>, verb: &WordExpr<Verb>, span: Span) {
        let Some(cover) = cover else { return };
        if let Some(body) = possible(cover).into_iter().find(|body| !body.like.is_vehicle()) {
            let message = format!("a `{}` hides nobody", self.body_name(body));
            let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message).at(span, "spawned here");
            self.report(error.help("write a vehicle after `from behind`"));
        }
        if let Some(verb) = possible(verb).into_iter().find(|verb| *verb != Verb::Walk) {
            let message = format!("`{}` does not begin behind a parked vehicle", verb.name());
            let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message).at(span, "spawned here");
            self.report(error.help("`from behind` is for a pedestrian that does `Walk`"));
        }
    }

    /// Reports a vehicle that walks, and a pedestrian that drives.
    fn check_verb(&mut self, body: &WordExpr<BodyWord>, verb: &WordExpr<Verb>, span: Span) {
        let verbs = possible(verb);
        let clash = possible(body)
            .into_iter()
            .find_map(|body| verbs.iter().find(|verb| !body.like.can(**verb)).map(|verb| (body, *verb)));
        if let Some((body, verb)) = clash {
            let message = format!("a `{}` cannot `{}`", self.body_name(body), verb.name());
            let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message).at(span, "spawned here");
            self.report(
                error.help(
                    "`Stand` and those with `Walk` are for a `Pedestrian` or an `Animal`, all other verbs for vehicles; an \
                     `Object` does `Stand` or `Follow`",
                ),
            );
        }
    }

    /// Reports a wrong `ahead` or `behind` of the ego vehicle: only some verbs begin behind it.
    fn check_side(&mut self, verb: &WordExpr<Verb>, behind: bool, span: Span) {
        for verb in possible(verb) {
            if verb.begins_behind() != behind {
                let (is, should) = if behind { ("behind", "ahead") } else { ("ahead of", "behind") };
                let message = format!("`{}` does not begin {is} the ego vehicle", verb.name());
                let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message).at(span, "spawned here");
                let other = if behind { "`DriveBehind`" } else { "`DriveAhead`" };
                self.report(error.help(format!("write `{should}`, or {other} for one that begins {is} it")));
                return;
            }
        }
    }
}

/// Every word that the expression can have as its value.
pub(super) fn possible<W: Copy>(word: &WordExpr<W>) -> Vec<W> {
    match word {
        WordExpr::Fixed(word) => vec![*word],
        WordExpr::Of(_, words) => words.clone(),
    }
}
