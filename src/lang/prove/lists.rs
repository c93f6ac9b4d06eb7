//! Rows, names and lists that several proofs go over.

use std::sync::Arc;

use crate::model::{Interval, Road, Row, Space};
use crate::syntax::listed;

/// A row on a road where it may run, with the ranges that rules leave to its numbers.
pub struct OpenRow<'a> {
    pub row: &'a Row,
    pub road: &'a Road,
    pub ranges: &'a [(Arc<str>, Interval)],
}

/// These rows on each road where they may run.
pub fn open_rows<'a>(space: &'a Space, rows: &'a [Row]) -> impl Iterator<Item = OpenRow<'a>> {
    let all = rows.iter().flat_map(move |row| space.roads.iter().zip(&row.roads).map(move |on| (row, on)));
    all.filter_map(|(row, (road, reach))| Some(OpenRow { row, road, ranges: reach.ranges()? }))
}

/// The names of rules, as a list in words.
pub fn rule_names(space: &Space, rules: &[usize]) -> String {
    listed(&rules.iter().map(|rule| space.rules[*rule].name.as_str()).collect::<Vec<_>>())
}

/// The different ones among these, in their order.
pub fn distinct<T: PartialEq>(all: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for one in all {
        if !found.contains(&one) {
            found.push(one);
        }
    }
    found
}

/// Each of these again with each of the values, which vary fastest; `put` puts a value in.
pub fn product<T: Clone, V: Copy>(all: &[T], values: &[V], put: impl Fn(&mut T, V)) -> Vec<T> {
    let mut longer = Vec::with_capacity(all.len() * values.len());
    for one in all {
        for value in values {
            let mut one = one.clone();
            put(&mut one, *value);
            longer.push(one);
        }
    }
    longer
}
