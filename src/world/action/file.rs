//! The action table as data and as text: what `avastra compile` writes and `avastra table` prints.

use serde::{Deserialize, Serialize};

use crate::action::table::ActionTable;
use avastra_lang::model::{Domain, End, Interval, Parameter, Reach, Row, RuleDef, Type};

/// Version of the file's fields. It rises when a field changes its meaning.
const VERSION: u32 = 1;

/// A whole table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableFile {
    pub version: u32,
    /// Path of the space's root file, as it was given.
    pub space: String,
    /// Digest of the space's meaning.
    pub digest: String,
    pub rules: Vec<RuleRecord>,
    pub rows: Vec<RowRecord>,
}

/// A rule and how many rows it binds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RuleRecord {
    pub name: String,
    pub optional: bool,
    pub rows: usize,
}

/// One row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RowRecord {
    /// Index of the network's output.
    pub row: usize,
    pub action: String,
    pub axes: Vec<AxisRecord>,
    /// Names of the rules that bind it, optional ones included.
    pub rules: Vec<String>,
    pub roads: Vec<RoadRecord>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisRecord {
    pub name: String,
    pub value: String,
}

/// A row on one road: its draws, or why it can never run there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RoadRecord {
    pub road: String,
    /// Why the row is masked; `None` if it is open.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub masked: Option<String>,
    pub draws: Vec<DrawRecord>,
}

/// The values that the default rules leave to a drawn parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DrawRecord {
    pub name: String,
    /// SI; empty for a choice.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// Ends of a number's range, SI.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub low: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub high: Option<f64>,
    /// The values of a choice.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub values: Vec<String>,
}

/// A table whose rows are made one after another as they are written, because a long table takes hundreds of megabytes.
#[derive(Serialize)]
struct Written<'a> {
    version: u32,
    space: String,
    digest: &'a str,
    rules: Vec<RuleRecord>,
    #[serde(serialize_with = "in_turn")]
    rows: &'a ActionTable,
}

fn in_turn<S: serde::Serializer>(table: &ActionTable, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(table.rows().iter().map(|row| table.row_record(row)))
}

impl ActionTable {
    /// The table as the text of a file, as [`TableFile`] reads it.
    ///
    /// # Errors
    /// None that is known: every part of a table can be written.
    pub fn yaml(&self) -> Result<String, serde_yaml::SerializeError> {
        let space = self.space();
        serde_yaml::to_string(&Written {
            version: VERSION,
            space: space.path.to_string_lossy().into_owned(),
            digest: space.meaning.digest(),
            rules: self.rule_records(),
            rows: self,
        })
    }

    /// The table as data.
    pub fn file(&self) -> TableFile {
        let space = self.space();
        TableFile {
            version: VERSION,
            space: space.path.to_string_lossy().into_owned(),
            digest: space.meaning.digest().to_owned(),
            rules: self.rule_records(),
            rows: self.rows().iter().map(|row| self.row_record(row)).collect(),
        }
    }

    fn rule_records(&self) -> Vec<RuleRecord> {
        let bound = |rule: usize| self.rows().iter().filter(|row| row.rules.contains(&rule)).count();
        let record = |(index, rule): (usize, &RuleDef)| RuleRecord {
            name: rule.name.clone(),
            optional: rule.optional,
            rows: bound(index),
        };
        self.space().rules.iter().enumerate().map(record).collect()
    }

    /// The table as text, one line for each row; with a road, also the row's ranges or its mask there.
    pub fn text(&self, road: Option<&str>) -> String {
        let space = self.space();
        let road = road.and_then(|name| space.roads.iter().position(|road| road.name == name));
        let width = self.rows().iter().map(|row| row.label.chars().count()).max().unwrap_or(0);
        let mut text = String::new();
        for row in self.rows() {
            let note = match road {
                Some(road) => self.note_on(row, road),
                None => self.note(row),
            };
            let line = format!("{:>4}  {:width$}  {note}", row.index, row.label);
            text.push_str(line.trim_end());
            text.push('\n');
        }
        text
    }

    /// Where the row is masked.
    fn note(&self, row: &Row) -> String {
        let roads = self.space().roads.iter().zip(&row.roads);
        let masked: Vec<&str> = roads
            .filter(|(_, reach)| matches!(reach, Reach::Dead { .. }))
            .map(|(road, _)| road.name.as_str())
            .collect();
        if masked.is_empty() { String::new() } else { format!("masked on {}", masked.join(", ")) }
    }

    fn note_on(&self, row: &Row, road: usize) -> String {
        match &row.roads[road] {
            Reach::Dead { reason, .. } => format!("masked: {reason}"),
            Reach::Open(_) => {
                let draws = self.draws(row, road).into_iter().map(|draw| match (draw.low, draw.high) {
                    (Some(low), Some(high)) => format!("{} {low:.2}..{high:.2} {}", draw.name, draw.unit),
                    _ => format!("{} of {}", draw.name, draw.values.len()),
                });
                draws.collect::<Vec<_>>().join(", ")
            }
        }
    }

    fn row_record(&self, row: &Row) -> RowRecord {
        let space = self.space();
        let action = &space.actions[row.action];
        let axes = action.parameters.iter().filter(|parameter| parameter.axis).zip(&row.axes);
        let roads = space.roads.iter().zip(&row.roads).enumerate();
        RowRecord {
            row: row.index,
            action: action.name.clone(),
            axes: axes
                .map(|(parameter, (name, value))| AxisRecord {
                    name: name.to_string(),
                    value: space.show_in_si(*value, parameter.ty),
                })
                .collect(),
            rules: row.rules.iter().map(|rule| space.rules[*rule].name.clone()).collect(),
            roads: roads
                .map(|(index, (road, reach))| RoadRecord {
                    road: road.name.clone(),
                    masked: match reach {
                        Reach::Dead { reason, .. } => Some(reason.clone()),
                        Reach::Open(_) => None,
                    },
                    draws: self.draws(row, index),
                })
                .collect(),
        }
    }

    /// What a row draws on the nth road, and within which bounds by the default rules.
    pub fn draws(&self, row: &Row, road: usize) -> Vec<DrawRecord> {
        let Reach::Open(ranges) = &row.roads[road] else { return Vec::new() };
        let drawn = self.space().actions[row.action].drawn();
        drawn
            .map(|parameter| {
                let range = ranges.iter().find(|(name, _)| *name == parameter.name);
                self.draw_record(parameter, range.map(|(_, interval)| interval))
            })
            .collect()
    }

    fn draw_record(&self, parameter: &Parameter, range: Option<&Interval>) -> DrawRecord {
        let end = |end: End| match end {
            End::At(value, _) => Some(value.to_f64()),
            End::Unbounded => None,
        };
        let unit = match parameter.ty {
            Type::Quantity(dimension) => dimension.si_unit(),
            Type::Int | Type::Bool | Type::Enum(_) => String::new(),
        };
        let name = parameter.name.to_string();
        match (&parameter.domain, range) {
            (Domain::Values(values), _) => {
                let space = self.space();
                let values = values.iter().map(|value| space.show_in_si(*value, parameter.ty)).collect();
                DrawRecord { name, unit: String::new(), low: None, high: None, values }
            }
            (Domain::Range(low, high), range) => {
                let (low, high) = (low.to_f64(), high.to_f64());
                let (low, high) =
                    range.map_or((Some(low), Some(high)), |range| (end(range.low), end(range.high)));
                DrawRecord { name, unit, low, high, values: Vec::new() }
            }
        }
    }
}
