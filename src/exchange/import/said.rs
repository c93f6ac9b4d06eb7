//! Text of the language with its numbers apart, so that files that differ in numbers alone can be told to be one.

use core::fmt::Write;

use avastra_base::geometry::Vec2;

/// A number as it is written, in units of its last place.
const PLACES: f64 = 1e4;

#[derive(Debug, Clone, PartialEq)]
pub enum Piece {
    Text(String),
    Number(Figure),
}

/// A number with its unit. Two that are written the same way are equal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Figure {
    rounded: i64,
    pub unit: &'static str,
}

impl Figure {
    pub fn new(value: f64, unit: &'static str) -> Figure {
        Figure { rounded: (value * PLACES).round() as i64, unit }
    }

    pub fn value(self) -> f64 {
        self.rounded as f64 / PLACES
    }

    /// `12.5 m`.
    pub fn text(self) -> String {
        let number = number(self.value());
        if self.unit.is_empty() { number } else { format!("{number} {}", self.unit) }
    }

    /// The type of the language that it has.
    pub fn type_name(self) -> &'static str {
        match self.unit {
            "m" => "Length",
            "s" => "Duration",
            "m/s" => "Speed",
            "m/s^2" => "Accel",
            _ => "Ratio",
        }
    }
}

/// A decimal without zeros at its end.
pub fn number(value: f64) -> String {
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Pieces one after another.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Said(pub Vec<Piece>);

impl Said {
    pub fn text(text: impl Into<String>) -> Said {
        Said(vec![Piece::Text(text.into())])
    }

    #[must_use]
    pub fn and(mut self, text: impl Into<String>) -> Said {
        self.0.push(Piece::Text(text.into()));
        self
    }

    #[must_use]
    pub fn number(mut self, value: f64, unit: &'static str) -> Said {
        self.0.push(Piece::Number(Figure::new(value, unit)));
        self
    }

    #[must_use]
    pub fn then(mut self, other: Said) -> Said {
        self.0.extend(other.0);
        self
    }

    /// All of them, with something between.
    pub fn joined(parts: impl IntoIterator<Item = Said>, between: &str) -> Said {
        parts.into_iter().enumerate().fold(Said::default(), |all, (nth, part)| match nth {
            0 => part,
            _ => all.and(between).then(part),
        })
    }

    /// Whether one of its texts is this.
    pub fn holds(&self, text: &str) -> bool {
        self.0.iter().any(|piece| matches!(piece, Piece::Text(own) if own == text))
    }

    /// The word before its first colon.
    pub fn name(&self) -> String {
        let text = self.form();
        text.split(':').next().unwrap_or_default().to_owned()
    }

    pub fn figures(&self) -> impl Iterator<Item = Figure> {
        self.0.iter().filter_map(|piece| match piece {
            Piece::Text(_) => None,
            Piece::Number(figure) => Some(*figure),
        })
    }

    /// The text with what `shown` makes of each number.
    pub fn shown(&self, mut shown: impl FnMut(Figure) -> String) -> String {
        let mut text = String::new();
        for piece in &self.0 {
            match piece {
                Piece::Text(part) => text.push_str(part),
                Piece::Number(figure) => {
                    let _ = write!(text, "{}", shown(*figure));
                }
            }
        }
        text
    }

    /// The text with the units alone in place of its numbers.
    pub fn form(&self) -> String {
        self.shown(|figure| format!("<{}>", figure.unit))
    }
}

pub fn points_text(points: &[Vec2]) -> String {
    let point = |point: &Vec2| format!("{{ x: {} m, y: {} m }}", number(point.x), number(point.y));
    let points: Vec<String> = points.iter().map(point).collect();
    format!("points: [{}]", points.join(", "))
}
