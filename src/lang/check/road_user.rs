//! Names of road users: the names that spawns give, and the road user that a question, an order or a parameter means.

use crate::check::checker::{Checker, each};
use crate::check::expression::Place;
use crate::check::mistakes::Report;
use crate::check::references::Symbol;
use crate::model::command::Told;
use crate::model::expr::Who;
use crate::model::vocabulary::{Body, Fact, Field, LIGHT, ROAD_USER, Verb, Word};
use crate::model::{EnumDef, Type, code};
use crate::prove::VARIANTS_MAX;
use crate::syntax::ast::{ItemKind, Span};
use crate::syntax::{Diagnostic, ast};

impl Checker {
    /// Notes the names that actions give to what they spawn. Phases, orders and rules may stand before them.
    pub(super) fn declare_bearers(&mut self, items: &[&ast::Item]) {
        let effects = each(items, ItemKind::as_action).flat_map(|(_, action)| &action.effects);
        let spawns = effects.filter_map(ast::Effect::spawn);
        for (name, spawn) in spawns.flat_map(|spawn| spawn.bearers.iter().map(move |name| (name, spawn))) {
            let ast::Spawn { body, place, fields, .. } = spawn;
            let is_on_foot = |name: &String| {
                let own = self.bodies.iter().find(|body| body.name == *name);
                let like = own.map(|own| own.like).or_else(|| Body::from_name(name));
                like.is_some_and(|like| !like.is_vehicle())
            };
            let does = fields.iter().find(|field| field.name.text == Field::Does.name());
            let verb = does.and_then(|field| match &field.value.kind {
                ast::ExprKind::Name(verb) => Verb::from_name(verb),
                _ => None,
            });
            let has = match (&body.kind, verb) {
                _ if place.trajectory().is_some() => Told::to(Verb::Follow),
                (ast::ExprKind::Name(body), Some(verb)) if is_on_foot(body) => Told::to(verb),
                (ast::ExprKind::Name(body), None) if is_on_foot(body) => Told::to(Verb::WalkAhead),
                _ => Told::BY_DRIVERS,
            };
            let most = self.obeys.entry(name.text.clone()).or_default();
            *most = most.and(has);
            let is_of_facts =
                Fact::ALL.iter().any(|fact| fact.name().split('.').next() == Some(name.text.as_str()));
            if is_of_facts || name.text == LIGHT.0 {
                let message = format!("`{}` cannot be the name of a road user", name.text);
                let error = Diagnostic::error(code::NOT_HERE, message);
                self.report(error.at(name.span, "the engine's own word").help("choose another name"));
            } else if !self.bearers.contains(&name.text) {
                self.bearers.push(name.text.clone());
            }
        }
    }

    /// The names of road users are the values of a type of their own, if a parameter is of that type.
    pub(super) fn declare_road_users(&mut self, items: &[&ast::Item]) {
        let of_actions =
            each(items, ItemKind::as_action).flat_map(|(_, action)| &action.params).map(|it| &it.ty);
        let of_manoeuvres =
            each(items, ItemKind::as_manoeuvre).flat_map(|(_, it)| &it.params).map(|it| &it.ty);
        let is_of_them =
            |ty: &ast::Type| matches!(&ty.kind, ast::TypeKind::Named(name) if name.text == ROAD_USER.0);
        let is_taken = self.enum_names.get(ROAD_USER.0).is_some();
        if is_taken || !of_actions.chain(of_manoeuvres).any(is_of_them) {
            return;
        }
        let span = Span::NONE;
        let variants: Vec<String> = self.bearers.iter().take(VARIANTS_MAX).cloned().collect();
        let odds = vec![1; variants.len()];
        let name = ROAD_USER.0.to_owned();
        self.enums.push(EnumDef { name, docs: Vec::new(), variants, ordered: false, odds, span });
        self.references.set_enums(self.enums.clone());
    }

    pub(super) fn is_road_user(&self, ty: Type) -> bool {
        matches!(ty, Type::Enum(of) if self.enums[of.0].name == ROAD_USER.0)
    }

    /// The road user that a name stands for: a parameter, or a name that a spawn gives.
    pub(super) fn who(&mut self, name: &str, span: Span, place: &Place<'_>) -> Option<Who> {
        let is_given = |(local, ty): &(String, Type)| local == name && self.is_road_user(*ty);
        if let Some(local) = place.locals.iter().position(is_given) {
            if let Some(owner) = place.owner {
                self.references.uses_parameter(&ast::Name::new(name, span), owner);
            }
            return Some(Who::Given(local));
        }
        let bearer = self.bearers.iter().position(|bearer| bearer == name)?;
        self.references.uses(span, Symbol::RoadUser(name.to_owned()));
        Some(Who::Named(bearer))
    }

    /// The road user that an order is for, or beside whom another one appears.
    pub(super) fn named_road_user(&mut self, who: &ast::Name, place: &Place<'_>) -> Option<Who> {
        self.who(&who.text, who.span, place).or_else(|| {
            self.references.uses(who.span, Symbol::RoadUser(who.text.clone()));
            let of_type = place.locals.iter().filter(|(_, ty)| self.is_road_user(*ty));
            let known = of_type.map(|(name, _)| name).chain(&self.bearers).map(String::as_str);
            let mut error = self.unknown("road user", &who.text, who.span, known);
            let name_it = || format!("name it where it appears: `spawn … as {} ahead …`", who.text);
            error.help = error.help.or_else(|| Some(name_it()));
            self.reject(error)
        })
    }
}
