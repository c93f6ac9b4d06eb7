//! Builds trees from pest's flat expressions by the table of operators, and bounds how high a tree may grow.

use pest::iterators::Pair;

use crate::syntax::ast::{Arg, Arm, Call, Expr, ExprKind, Name, Span, Text};
use crate::syntax::build::{Builder, Built, Parts};
use crate::syntax::grammar::{Role, Rule, role};
use crate::syntax::operator::{Grouping, Operator};
use crate::syntax::{Diagnostic, OPERATORS_MAX, code};

/// The flat form of an expression, read from the left.
type Tokens<'i> = std::iter::Peekable<std::vec::IntoIter<Pair<'i, Rule>>>;

impl Builder {
    pub fn expression(&self, pair: Pair<'_, Rule>) -> Built<Expr> {
        let span = self.span(&pair);
        let tokens: Vec<_> = pair.into_inner().collect();
        let operators = tokens.iter().filter(|token| token.as_rule() != Rule::operand).count();
        self.below(operators, span, || self.climb(&mut tokens.into_iter().peekable(), 0))
    }

    /// Runs `build` under this many more operators. A chain of operators makes a tree as high as the chain
    /// is long, and later stages walk trees by recursion: so chains are bounded like brackets.
    fn below<T>(&self, operators: usize, span: Span, build: impl FnOnce() -> Built<T>) -> Built<T> {
        let above = self.operators_above.get();
        if above + operators > OPERATORS_MAX {
            let message = format!("an expression with more than {OPERATORS_MAX} operators in one another");
            let help =
                "give a part of it a name, with `let` or `fn`; where it is long, join parts in brackets";
            return Err(Diagnostic::error(code::DEPTH, message).at(span, "").help(help));
        }
        self.operators_above.set(above + operators);
        let built = build();
        self.operators_above.set(above);
        built
    }

    /// Precedence climbing: reads on as long as operators have at least the level `least`.
    fn climb(&self, tokens: &mut Tokens<'_>, least: u8) -> Built<Expr> {
        let mut left = self.prefixed(tokens)?;
        while let Some(token) = tokens.peek() {
            let (op_span, op) = (self.span(token), operator(token));
            if op.level() < least {
                break;
            }
            tokens.next();
            let right = self.climb(tokens, op.right_least())?;
            if op.grouping() == Grouping::Never {
                self.refuse_chain(op, tokens.peek())?;
            }
            let span = left.span.to(right.span);
            let (left_box, right_box) = (Box::new(left), Box::new(right));
            let kind = match op {
                Operator::Range => ExprKind::Range { low: left_box, high: right_box },
                Operator::Binary(op) => ExprKind::Binary { op, op_span, left: left_box, right: right_box },
                Operator::Unary(_) => unreachable!("the grammar puts an infix operator behind an operand"),
            };
            left = Expr { kind, span };
        }
        Ok(left)
    }

    /// Refuses `a < b < c`, which the language does not have.
    fn refuse_chain(&self, op: Operator, next: Option<&Pair<'_, Rule>>) -> Built<()> {
        let Some(next) = next.filter(|next| operator(next).level() == op.level()) else {
            return Ok(());
        };
        let (message, help) = match op {
            Operator::Range => ("a range has two ends", "write `low .. high`"),
            Operator::Binary(_) | Operator::Unary(_) => {
                ("comparisons do not chain", "write `a < b and b < c`")
            }
        };
        Err(Diagnostic::error(code::CHAIN, message).at(self.span(next), "second one").help(help))
    }

    fn prefixed(&self, tokens: &mut Tokens<'_>) -> Built<Expr> {
        let token = tokens.next().expect("the grammar promises an operand");
        if token.as_rule() == Rule::operand {
            return self.operand(token);
        }
        let (start, prefix) = (self.span(&token), operator(&token));
        let Operator::Unary(op) = prefix else {
            unreachable!("the grammar begins no expression with an infix")
        };
        let operand = self.climb(tokens, prefix.right_least())?;
        let span = start.to(operand.span);
        Ok(Expr { kind: ExprKind::Unary { op, operand: Box::new(operand) }, span })
    }

    fn operand(&self, pair: Pair<'_, Rule>) -> Built<Expr> {
        let outer = self.span(&pair);
        let parts: Vec<_> = pair.into_inner().collect();
        self.below(parts.len() - 1, outer, || {
            let mut parts = parts.into_iter();
            let atom = self.atom(parts.next().expect("an operand begins with an atom"))?;
            parts.try_fold(atom, |base, part| {
                let span = outer.to(self.span(&part));
                let accesses_field = part.as_rule() == Rule::field_access;
                let inner = Parts::of(part).next();
                let base = Box::new(base);
                let kind = if accesses_field {
                    ExprKind::Field { base, field: self.name(inner) }
                } else {
                    ExprKind::Index { base, index: Box::new(self.expression(inner)?) }
                };
                Ok(Expr { kind, span })
            })
        })
    }

    fn atom(&self, pair: Pair<'_, Rule>) -> Built<Expr> {
        let span = self.span(&pair);
        let kind = match pair.as_rule() {
            Rule::number => ExprKind::Number(self.number(pair)),
            Rule::text => ExprKind::Text(self.text(pair)?.value),
            Rule::boolean => ExprKind::Bool(pair.as_str() == "true"),
            Rule::name => ExprKind::Name(pair.as_str().to_owned()),
            Rule::parenthesised => return self.expression(Parts::of(pair).next()),
            Rule::list => ExprKind::List(self.all(Parts::of(pair), Builder::expression)?),
            Rule::record => ExprKind::Record(self.fields(Parts::of(pair).next())?),
            Rule::call => ExprKind::Call(self.call(pair)?),
            Rule::match_expression => self.match_expression(pair)?,
            Rule::lane_point => self.lane_point(pair)?,
            Rule::numbered => {
                let mut parts = Parts::of(pair);
                let name = self.name(parts.next());
                ExprKind::Numbered { name, number: parts.next().as_str().to_owned() }
            }
            other => unreachable!("an atom is never `{other:?}`"),
        };
        Ok(Expr { kind, span })
    }

    pub fn call(&self, pair: Pair<'_, Rule>) -> Built<Call> {
        let span = self.span(&pair);
        let mut parts = Parts::of(pair);
        let name = self.name(parts.next());
        let arguments = Parts::of(parts.next()).rest().map(|argument| {
            let mut argument = Parts::of(argument);
            let name = argument.take(Rule::argument_name).map(|name| self.name(Parts::of(name).next()));
            Ok(Arg { name, value: self.expression(argument.next())? })
        });
        Ok(Call { name, args: arguments.collect::<Built<_>>()?, span })
    }

    fn match_expression(&self, pair: Pair<'_, Rule>) -> Built<ExprKind> {
        let mut parts = Parts::of(pair);
        let subject = Box::new(self.expression(parts.next())?);
        Ok(ExprKind::Match { subject, arms: self.all(parts, Builder::arm)? })
    }

    pub fn arm(&self, pair: Pair<'_, Rule>) -> Built<Arm> {
        let span = self.span(&pair);
        let mut parts = Parts::of(pair);
        let mut patterns = Vec::new();
        if parts.take(Rule::otherwise).is_none() {
            while let Some(pattern) = parts.take(Rule::pattern) {
                let span = self.span(&pattern);
                let words: Vec<&str> = pattern.as_str().split_whitespace().collect();
                patterns.push(Name::new(words.join(" "), span));
            }
        }
        Ok(Arm { patterns, value: self.expression(parts.next())?, span })
    }

    fn lane_point(&self, pair: Pair<'_, Rule>) -> Built<ExprKind> {
        let mut parts = Parts::of(pair);
        let road = match parts.take(Rule::text) {
            Some(quoted) => self.text(quoted)?,
            None => {
                let road = parts.next();
                Text::new(road.as_str(), self.span(&road))
            }
        };
        let lane = self.name(parts.next());
        // Skips `at`: clauses need this keyword as a part of the pair.
        parts.next();
        Ok(ExprKind::LanePoint { road, lane, station: self.number(parts.next()) })
    }
}

/// The operator of a `prefix` or an `infix` pair.
fn operator(pair: &Pair<'_, Rule>) -> Operator {
    let token = pair.clone().into_inner().next().expect("the rule is one operator").as_rule();
    match role(token) {
        Role::Operator(operator) => operator,
        Role::Said(_) | Role::Unsaid => unreachable!("`{token:?}` is no operator"),
    }
}
