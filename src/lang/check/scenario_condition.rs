//! The conditions of scenarios: `once ego.junction_ahead <= 40 m`. They may name states and functions of the space,
//! facts of the moment, and road users by their number.

use crate::check::checker::{Announced, Checker};
use crate::check::expression::Place;
use crate::check::names::Names;
use crate::model::expr::Expr;
use crate::model::vocabulary::Site;
use crate::model::{FnDef, Space, Type};
use crate::syntax::ast::Name;
use crate::syntax::{Diagnostic, ast};

/// A condition over a space.
///
/// # Errors
/// All mistakes in it.
pub(super) fn condition(space: &Space, written: &ast::Expr) -> Result<Expr, Vec<Diagnostic>> {
    let mut function_names = Names::default();
    for function in &space.functions {
        let name = Name::new(function.name.clone(), function.span);
        function_names.declare("function", &name).expect("a space has each name once");
    }
    let signature = |function: &FnDef| (function.parameters.clone(), function.result, function.span);
    let mut checker = Checker {
        enums: space.enums.clone(),
        states: space.states.clone(),
        announced: Announced {
            roads: space.roads.iter().map(|road| road.name.clone()).collect(),
            ..Announced::default()
        },
        function_names,
        signatures: space.functions.iter().map(|function| Some(signature(function))).collect(),
        functions: space.functions.clone(),
        bearers: space.bearers.clone(),
        ..Checker::default()
    };
    let states = space.states.iter().enumerate();
    checker.state_places = states.map(|(index, state)| (state.name.clone(), index)).collect();
    checker.references.set_enums(space.enums.clone());
    let place = Place { states: true, site: Site::Trigger, ..Place::default() };
    checker.typed(written, &place, Type::Bool).ok_or(checker.diagnostics)
}
