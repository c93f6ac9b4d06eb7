//! Lane sections whose speed limits, or rules of access, change along them are cut there: each lane of the graph has one of each.
//!
//! A section without such a change stays as it is.

use super::elements::{Holds, LaneElement, Limit, SectionElement, TypeElement};
use super::xml::wrong;
use crate::RoadError;

/// A shorter piece is not cut off, m: what holds in its middle counts.
const PIECE_M_MIN: f64 = 1.0;

/// Limit on the lanes that the sections of a map are cut into: a record of a few bytes cuts all lanes of a road.
const LANES_MAX: usize = 1_000_000;

/// Cuts the sections of a road, and notes on each lane what holds on it.
///
/// # Errors
/// If the map has too many of them.
pub fn cut(
    sections: Vec<SectionElement>,
    types: &[TypeElement],
    lanes_cut: &mut usize,
) -> Result<Vec<SectionElement>, RoadError> {
    let mut all = Vec::new();
    for mut section in sections {
        let mut pieces = pieces(&section, types);
        let last = pieces.len() - 1;
        if last == 0 {
            let (_, _, held) = pieces.remove(0);
            section.lanes.iter_mut().zip(held).for_each(|(lane, held)| lane.holds = held);
            all.push(section);
            continue;
        }
        *lanes_cut = lanes_cut.saturating_add(pieces.len().saturating_mul(section.lanes.len()));
        if *lanes_cut > LANES_MAX {
            let line = section.lanes.first().map_or(1, |lane| lane.line);
            let message = "the limits of speed and the rules of access up to here change too often; cut out the \
                           part to be driven";
            return Err(wrong(line, message));
        }
        for (nth, (from_m, to_m, held)) in pieces.into_iter().enumerate() {
            let lanes = section.lanes.iter().zip(held).map(|(lane, held)| {
                let mut piece = lane.between(from_m - section.begin_m, to_m - section.begin_m);
                piece.holds = held;
                if nth > 0 {
                    piece.predecessors = vec![lane.id];
                }
                if nth < last {
                    piece.successors = vec![lane.id];
                }
                piece
            });
            all.push(SectionElement { begin_m: from_m, end_m: to_m, lanes: lanes.collect() });
        }
    }
    Ok(all)
}

/// From, to, and what holds on each lane in between.
type Piece = (f64, f64, Vec<Holds>);

fn pieces(section: &SectionElement, types: &[TypeElement]) -> Vec<Piece> {
    let (begin_m, end_m) = (section.begin_m, section.end_m);
    let first = types.partition_point(|one| one.begin_m <= begin_m);
    let of_road = types[first..].iter().map(|one| one.begin_m).take_while(|at_m| *at_m < end_m);
    let mut cuts_m: Vec<f64> = of_road.collect();
    for lane in section.lanes.iter().filter(|lane| lane.undriven.is_none()) {
        let records = lane.speeds.iter().map(|(at_m, _)| at_m).chain(lane.buses.iter().map(|(at_m, _)| at_m));
        cuts_m.extend(records.map(|at_m| begin_m + at_m));
    }
    cuts_m.sort_by(f64::total_cmp);
    let mut pieces: Vec<Piece> = Vec::new();
    let mut from_m = begin_m;
    for to_m in cuts_m.into_iter().chain([end_m]) {
        let is_last = to_m == end_m;
        if !is_last && !(from_m + PIECE_M_MIN..=end_m - PIECE_M_MIN).contains(&to_m) {
            continue;
        }
        let held = section.lanes.iter().map(|lane| holds(section, lane, types, (from_m + to_m) / 2.0));
        let held: Vec<Holds> = held.collect();
        match pieces.last_mut().filter(|before| before.2 == held) {
            Some(before) => before.1 = to_m,
            None => pieces.push((from_m, to_m, held)),
        }
        from_m = to_m;
        if is_last {
            break;
        }
    }
    pieces
}

fn holds(section: &SectionElement, lane: &LaneElement, types: &[TypeElement], s_m: f64) -> Holds {
    let own = holding(&lane.speeds, s_m - section.begin_m).copied().unwrap_or(Limit::Unstated);
    let begun = types.partition_point(|one| one.begin_m <= s_m);
    let of_road = types[..begun].last();
    Holds {
        limit: match own {
            Limit::Unstated => of_road.map_or(Limit::Unstated, |one| one.limit),
            own => own,
        },
        is_motorway: of_road.is_some_and(|one| one.is_motorway),
        for_buses: holding(&lane.buses, s_m - section.begin_m).copied().unwrap_or(false),
    }
}

/// The last of records by rising station that has begun.
fn holding<T>(records: &[(f64, T)], at_m: f64) -> Option<&T> {
    let begun = records.partition_point(|(begin_m, _)| *begin_m <= at_m);
    records[..begun].last().map(|(_, record)| record)
}
