//! The outcomes of each row: in how many steps it was legal when the agent asked for it, and the reasons for refusals.
//! An episode notes the offers of every step ([`Offered`]), `run.db` adds the episodes up, and [`RowCount`] is the sum
//! for one row. From these a run says at its end which rows never happened.

use std::borrow::Cow;
use std::collections::BTreeMap;

use avastra_base::units::unit;
use avastra_world::action::{Offer, Refusal};

use crate::run::database::RefusalCount;

/// The offers of an episode, step by step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Offered {
    rows: Vec<RowOffers>,
}

/// The offers of a row.
#[derive(Debug, Clone, Default, PartialEq)]
struct RowOffers {
    legal: u32,
    refused: Vec<Refusal>,
}

impl Offered {
    /// One step's offers, by row, those for which the agent asked; where only one row is `played`, that one alone. Refusals are
    /// put in words once, at the end: most steps refuse most rows.
    pub(super) fn note(&mut self, offers: &[Option<Offer>], played: Option<usize>) {
        self.rows.resize_with(offers.len(), RowOffers::default);
        let noted = self.rows.iter_mut().zip(offers).enumerate();
        for (_, (row, offer)) in noted.filter(|(row, _)| played.is_none_or(|played| played == *row)) {
            match offer {
                Some(Ok(_)) => row.legal += 1,
                Some(Err(refusal)) => row.refused.push(refusal.clone()),
                None => {}
            }
        }
    }

    /// Steps by row and reason; without a reason the row was legal.
    pub(super) fn steps(&self) -> BTreeMap<(usize, Option<String>), u32> {
        let mut steps = BTreeMap::new();
        for (index, row) in self.rows.iter().enumerate() {
            if row.legal > 0 {
                steps.insert((index, None), row.legal);
            }
            for Refusal { rule, reason } in &row.refused {
                *steps.entry((index, Some(in_words(rule.as_deref(), reason)))).or_default() += 1;
            }
        }
        steps
    }
}

/// The outcomes of a row in all episodes of a run.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct RowCount {
    /// Steps in which the agent asked for it, and it was legal.
    pub legal: i64,
    /// Steps in which the agent chose it.
    pub chosen: i64,
    /// Steps in which it was carried out.
    pub realised: i64,
    /// The reasons that refused it in the other steps in which the agent asked for it, the most frequent first.
    pub refused: Vec<RefusalCount>,
}

/// Why a row is refused, with the rule if one refuses it. Figures are replaced by `…`, so that reasons which differ
/// only in figures count as one.
pub fn in_words(rule: Option<&str>, reason: &str) -> String {
    let reason = without_figures(reason);
    rule.map_or(reason.clone(), |rule| format!("{rule}: {reason}"))
}

/// A reason with `…` for each number. A quantity that only says more (`of 3.2 m`, `within 60 m`) is left out with its
/// preposition: the rest is a sentence without it.
pub(super) fn without_figures(reason: &str) -> String {
    // Nearly all words are none, and telling so by their first letter is cheaper than reading them as numbers.
    let may_be = |letter: char| letter.is_ascii_digit() || "+-.iInN".contains(letter);
    let is_figure = |word: &str| word.starts_with(may_be) && word.parse::<f64>().is_ok();
    let words: Vec<&str> = reason.split(' ').collect();
    let mut shown: Vec<Cow<'_, str>> = Vec::with_capacity(words.len());
    let mut at = 0;
    while let Some(word) = words.get(at) {
        if let ["of" | "within", figure, quantity, ..] = &words[at..]
            && is_figure(figure)
            && unit(quantity).is_some()
        {
            at += 3;
            continue;
        }
        let bare = word.trim_end_matches([',', ';']);
        shown.push(if is_figure(bare) { word.replace(bare, "…").into() } else { (*word).into() });
        at += 1;
    }
    shown.join(" ")
}
