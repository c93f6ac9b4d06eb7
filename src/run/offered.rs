//! What became of each row: in how many steps it was legal, and what stood in its way in the others.
//!
//! An episode notes every offer of every step ([`Offered`]), `run.db` adds episodes up, and [`RowCount`] is what comes
//! out for a row. A run says at its end which rows never happened.

use std::collections::BTreeMap;

use crate::action::{Offer, Refusal};

use crate::run::database::RefusalCount;

/// The offers of an episode, added up over its steps.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Offered {
    /// Steps by row and reason; without a reason the row was legal.
    pub(super) steps: BTreeMap<(usize, Option<String>), u32>,
}

impl Offered {
    /// One step's offers, by row.
    pub(super) fn note(&mut self, offers: &[Offer]) {
        for (row, offer) in offers.iter().enumerate() {
            let reason = match offer {
                Offer::Legal(_) => None,
                Offer::Refused(Refusal { rule, reason, .. }) => Some(in_words(rule.as_deref(), reason)),
            };
            *self.steps.entry((row, reason)).or_default() += 1;
        }
    }
}

/// What became of a row in all episodes of a run.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct RowCount {
    /// Steps in which it was legal.
    pub legal: i64,
    /// Steps in which the agent chose it.
    pub chosen: i64,
    /// Steps in which it was carried out.
    pub realised: i64,
    /// What stood in its way in the other steps, the most frequent first.
    pub refused: Vec<RefusalCount>,
}

/// Why a row is refused, with the rule if one refuses it. Figures are replaced by `…`, so that reasons which differ
/// only in figures count as one.
pub(super) fn in_words(rule: Option<&str>, reason: &str) -> String {
    let reason = without_figures(reason);
    rule.map_or(reason.clone(), |rule| format!("{rule}: {reason}"))
}

/// A reason with `…` for each number.
pub(super) fn without_figures(reason: &str) -> String {
    let is_figure = |word: &str| word.parse::<f64>().is_ok();
    let shown = reason.split(' ').map(|word| {
        let bare = word.trim_end_matches([',', ';']);
        if is_figure(bare) { word.replace(bare, "…") } else { word.to_owned() }
    });
    shown.collect::<Vec<_>>().join(" ")
}
