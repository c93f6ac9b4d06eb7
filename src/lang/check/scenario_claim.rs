//! The claims of a scenario about its replay: `expect collision with npc#2 at 14.22 s`, `expect end == arrived`.

use crate::check::mistakes::Report;
use crate::check::names::unknown;
use crate::check::scenario::Reader;
use crate::check::scenario_value::figure;
use crate::model::code;
use crate::model::scenario::{Claim, DRIVERS, ENDS, Figure, MODULES, Obstacle, REPLAYS_MAX};
use crate::model::vocabulary::{
    Avoidability, BREACHED, Fact, KEPT, ObstacleKind, Priority, RECURRENCE, ScenarioClaim, Word,
};
use crate::syntax::ast::{Arithmetic, BinaryOp, ClauseKind, Comparison};
use crate::syntax::{Diagnostic, ast, listed};
use avastra_base::units::Dimension;

impl Reader<'_> {
    /// A claim of a scenario; `None` once what is wrong with it is reported.
    pub(super) fn claim(&mut self, expect: &ast::Expect) -> Option<Claim> {
        let unclear = || {
            Diagnostic::error(code::UNKNOWN_CLAIM, "unknown claim").at(expect.span, "cannot be checked").help(
                "claims are `collision with npc#2 at 14.22 s`, `proc == [0.5]`, `trace == \"sha256:…\"`, \
                 `end == arrived`, `avoidable by [cc, fsm]`, `cause == perception`, `priority == other`, \
                 `recurrence == 14 / 20`, `minimal`, the name of a verdict, or `NAME.breached at 14.22 s` with that of a requirement",
            )
        };
        match &expect.claim.kind {
            ast::ExprKind::Name(name) if name == Fact::Collision.name() => {
                let (obstacle, time) = self.clauses(&expect.clauses, true)?;
                Some(Claim::Collision { obstacle, time })
            }
            ast::ExprKind::Name(name) if self.space.verdicts.iter().any(|verdict| verdict.name == *name) => {
                let (obstacle, _) = self.clauses(&expect.clauses, false)?;
                Some(Claim::Verdict { name: name.clone(), obstacle })
            }
            ast::ExprKind::Field { base, field } if field.text == KEPT.0 => self.kept(base, expect),
            ast::ExprKind::Field { base, field } if field.text == BREACHED.0 => {
                self.breach(base, &expect.clauses)
            }
            ast::ExprKind::Name(name) if name == ScenarioClaim::Minimal.name() => {
                let (obstacle, _) = self.clauses(&expect.clauses, false)?;
                Some(Claim::Minimal { obstacle })
            }
            ast::ExprKind::Name(name) if let Some(class) = Avoidability::from_name(name) => {
                self.avoidability(class, expect)
            }
            ast::ExprKind::Binary { op: BinaryOp::Compare(Comparison::Equal), left, right, .. } => {
                match (&left.kind, &right.kind) {
                    (ast::ExprKind::Name(name), ast::ExprKind::List(items)) if name == "proc" => {
                        self.no_clause(&expect.clauses)?;
                        let values = items.iter().map(|item| self.take(figure(item, Dimension::RATIO)));
                        values.collect::<Option<_>>().map(Claim::Proc)
                    }
                    (ast::ExprKind::Name(name), _) if name == ScenarioClaim::Recurrence.name() => {
                        let (recurred, replays) = self.share(right)?;
                        let (obstacle, from) = self.clauses(&expect.clauses, true)?;
                        Some(Claim::Recurrence { requirement: None, obstacle, from, recurred, replays })
                    }
                    (ast::ExprKind::Field { base, field }, _) if field.text == RECURRENCE.0 => {
                        let requirement = Some(self.requirement(base)?);
                        let (recurred, replays) = self.share(right)?;
                        match self.clauses(&expect.clauses, true)? {
                            (None, from) => {
                                let obstacle = None;
                                Some(Claim::Recurrence { requirement, obstacle, from, recurred, replays })
                            }
                            (Some(_), _) => {
                                let example = format!("{}.{} == 14 / 20", name_in(base), RECURRENCE.0);
                                self.names_a_road_user(&expect.clauses, &example)
                            }
                        }
                    }
                    (ast::ExprKind::Name(name), ast::ExprKind::Text(text))
                        if name == ScenarioClaim::Trace.name() =>
                    {
                        self.no_clause(&expect.clauses)?;
                        if !is_digest(text) {
                            let error =
                                Diagnostic::error(code::UNKNOWN_CLAIM, "this is the digest of no trace");
                            let error = error.at(right.span, "not `sha256:` and 64 digits from 0 to f");
                            return self
                                .reject(error.help("`avastra replay FILE` says which digest was found"));
                        }
                        Some(Claim::Trace(text.clone()))
                    }
                    (ast::ExprKind::Name(name), _) if name == ScenarioClaim::Cause.name() => {
                        let modules = self.modules(right)?;
                        let (obstacle, _) = self.clauses(&expect.clauses, false)?;
                        Some(Claim::Cause { modules, obstacle })
                    }
                    (ast::ExprKind::Name(name), _) if name == ScenarioClaim::Priority.name() => {
                        let priority = self.priority(right)?;
                        let (obstacle, _) = self.clauses(&expect.clauses, false)?;
                        Some(Claim::Priority { priority, obstacle })
                    }
                    (ast::ExprKind::Name(name), ast::ExprKind::Name(end))
                        if name == ScenarioClaim::End.name() =>
                    {
                        self.no_clause(&expect.clauses)?;
                        if !ENDS.contains(&end.as_str()) {
                            let message = format!("an episode does not end `{end}`");
                            let error = Diagnostic::error(code::UNKNOWN_CLAIM, message);
                            let error = error.at(right.span, "unknown end");
                            return self.reject(error.help(format!("ends are {}", listed(&ENDS))));
                        }
                        Some(Claim::End(end.clone()))
                    }
                    _ => self.reject(unclear()),
                }
            }
            _ => self.reject(unclear()),
        }
    }

    /// `stops_at_red.breached at 14.22 s`.
    fn breach(&mut self, requirement: &ast::Expr, clauses: &[ast::Clause]) -> Option<Claim> {
        let name = self.requirement(requirement)?;
        match self.clauses(clauses, true)? {
            (None, time) => Some(Claim::Breach { requirement: name, time }),
            (Some(_), _) => {
                let example = format!("{}.{} at 14.22 s", name_in(requirement), BREACHED.0);
                self.names_a_road_user(clauses, &example)
            }
        }
    }

    /// `stops_at_red.breached with npc#1`: what a scenario claims of a requirement, it claims of all whom it is about.
    fn names_a_road_user<T>(&mut self, clauses: &[ast::Clause], example: &str) -> Option<T> {
        let message = "a claim about a requirement does not name a road user";
        let error = Diagnostic::error(code::UNKNOWN_CLAIM, message);
        let with = clauses.iter().find(|clause| clause.kind == ClauseKind::With);
        let with = with.expect("only clauses `with` name one");
        self.reject(
            error.at(with.span, "it is about whomever the requirement is").help(format!("write `{example}`")),
        )
    }

    /// `14 / 20`: in how many of how many replays.
    fn share(&mut self, value: &ast::Expr) -> Option<(u32, u32)> {
        let whole = |expr: &ast::Expr| match &expr.kind {
            ast::ExprKind::Number(number) if number.unit.is_none() => number.digits.parse::<u32>().ok(),
            _ => None,
        };
        if let ast::ExprKind::Binary { op: BinaryOp::Arithmetic(Arithmetic::Divide), left, right, .. } =
            &value.kind
            && let (Some(recurred), Some(replays)) = (whole(left), whole(right))
            && recurred <= replays
            && (1..=REPLAYS_MAX).contains(&replays)
        {
            return Some((recurred, replays));
        }
        let error = Diagnostic::error(code::UNKNOWN_CLAIM, "wanted in how many of how many replays");
        let help = format!("write `recurrence == 14 / 20`, with at most {REPLAYS_MAX} replays");
        self.reject(error.at(value.span, "").help(help))
    }

    /// `stops_at_red.kept by [cc, fsm]`.
    fn kept(&mut self, requirement: &ast::Expr, expect: &ast::Expect) -> Option<Claim> {
        let name = self.requirement(requirement)?;
        match expect.clauses.as_slice() {
            [ast::Clause { kind: ClauseKind::By, value, .. }]
                if let ast::ExprKind::List(items) = &value.kind =>
            {
                let by = self.words(items, "reference driver", "a reference driver", &DRIVERS)?;
                Some(Claim::Kept { requirement: name, by })
            }
            _ => {
                let error = Diagnostic::error(code::UNKNOWN_CLAIM, "wanted one list of reference drivers");
                let help = format!("write `{name}.kept by [cc, fsm]`, or `by []` for none");
                self.reject(error.at(expect.span, "by whom?").help(help))
            }
        }
    }

    /// The name of a requirement of the space.
    fn requirement(&mut self, requirement: &ast::Expr) -> Option<String> {
        let name = self.name_of(requirement, "the name of a requirement")?.to_owned();
        let known = || self.space.requirements.iter().map(|required| required.name.as_str());
        match known().any(|known| known == name) {
            true => Some(name),
            false => {
                let error = unknown("requirement", &name, requirement.span, known());
                self.reject(error)
            }
        }
    }

    /// `ego`, `other` or `none`.
    fn priority(&mut self, value: &ast::Expr) -> Option<Priority> {
        let name = self.name_of(value, "`ego`, `other` or `none`")?;
        let error = || unknown("priority", name, value.span, Priority::names());
        self.take(Priority::from_name(name).ok_or_else(error))
    }

    /// `perception`, or `[tracking, planning]`.
    fn modules(&mut self, value: &ast::Expr) -> Option<Vec<String>> {
        let items = match &value.kind {
            ast::ExprKind::List(items) => items.as_slice(),
            _ => core::slice::from_ref(value),
        };
        self.words(items, "module", "a module of the driving system", &MODULES)
    }

    /// Names out of a closed set; `what` is one of them, `wanted` with its article.
    fn words(
        &mut self,
        items: &[ast::Expr],
        what: &str,
        wanted: &str,
        known: &[&'static str],
    ) -> Option<Vec<String>> {
        let mut words = Vec::new();
        for item in items {
            let name = self.name_of(item, wanted)?;
            if !known.contains(&name) {
                return self.reject(unknown(what, name, item.span, known.iter().copied()));
            }
            words.push(name.to_owned());
        }
        Some(words)
    }

    /// `avoidable by [cc, fsm] with npc#2`.
    fn avoidability(&mut self, class: Avoidability, expect: &ast::Expect) -> Option<Claim> {
        let (by, others): (Vec<&ast::Clause>, Vec<&ast::Clause>) =
            expect.clauses.iter().partition(|clause| clause.kind == ClauseKind::By);
        let drivers = match by.as_slice() {
            [] => None,
            [clause] if let ast::ExprKind::List(items) = &clause.value.kind => {
                Some(self.words(items, "reference driver", "a reference driver", &DRIVERS)?)
            }
            [clause, ..] => {
                let error = Diagnostic::error(code::UNKNOWN_CLAIM, "wanted one list of reference drivers");
                return self.reject(error.at(clause.span, "not one").help("write `avoidable by [cc, fsm]`"));
            }
        };
        let others: Vec<ast::Clause> = others.into_iter().cloned().collect();
        let (obstacle, _) = self.clauses(&others, false)?;
        Some(Claim::Avoidability { class, by: drivers, obstacle })
    }

    /// A claim about the whole episode has neither a road user nor a time.
    fn no_clause(&mut self, clauses: &[ast::Clause]) -> Option<()> {
        let Some(clause) = clauses.first() else { return Some(()) };
        let error = Diagnostic::error(code::UNKNOWN_CLAIM, "unknown clause of this claim");
        self.reject(error.at(clause.span, "").help("it is about the whole episode: leave this out"))
    }

    /// `with npc#2` and, if the claim has a time, `at 14.22 s`, each once at most.
    fn clauses(
        &mut self,
        clauses: &[ast::Clause],
        timed: bool,
    ) -> Option<(Option<Obstacle>, Option<Figure>)> {
        let (mut obstacle, mut time) = (None, None);
        for (index, clause) in clauses.iter().enumerate() {
            if clauses[..index].iter().any(|other| other.kind == clause.kind) {
                let error = Diagnostic::error(code::UNKNOWN_CLAIM, "this stands twice in the claim");
                return self.reject(error.at(clause.span, "").help("leave one of the two out"));
            }
            match (clause.kind, &clause.value.kind) {
                (ClauseKind::With, ast::ExprKind::Numbered { name, number })
                    if number.parse::<u32>().is_ok_and(|number| number > 0) =>
                {
                    let Some(kind) = ObstacleKind::from_name(&name.text) else {
                        let words = ObstacleKind::names();
                        return self.reject(unknown("road user", &name.text, name.span, words));
                    };
                    obstacle = number.parse().ok().map(|number| Obstacle { kind, number });
                }
                (ClauseKind::At, _) if timed => {
                    let found = self.take(figure(&clause.value, Dimension::DURATION))?;
                    if found.value < 0.0 {
                        let message = "no time of an episode is negative";
                        let error = Diagnostic::error(code::UNKNOWN_CLAIM, message);
                        let error = error.at(clause.value.span, "before its beginning");
                        return self.reject(error.help("count from 0 s"));
                    }
                    time = Some(found);
                }
                _ => {
                    let error = Diagnostic::error(code::UNKNOWN_CLAIM, "unknown clause of this claim");
                    let help = match clause.kind {
                        ClauseKind::At => "this claim has no time: leave it out",
                        _ => "write `collision with npc#2 at 14.22 s`; obstacles are numbered from 1",
                    };
                    return self.reject(error.at(clause.span, "").help(help));
                }
            }
        }
        Some((obstacle, time))
    }
}

/// Whether a text has the form in which avastra prints a SHA-256 digest.
fn is_digest(text: &str) -> bool {
    let digits = text.strip_prefix("sha256:").unwrap_or("");
    digits.len() == 64 && digits.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}

/// The name that an expression is.
fn name_in(expr: &ast::Expr) -> &str {
    match &expr.kind {
        ast::ExprKind::Name(name) => name,
        _ => "NAME",
    }
}
