//! Shards: a run, a study or an estimate cut into pieces that machines without anything in common play.
//! The units of work are dealt out to the pieces: episodes, jobs of a study, parts of an estimate. Units know nothing
//! of each other, and a unit gives the same rows in every piece, so a merge only has to bring them together.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::str::FromStr;

/// One of several pieces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, try_from = "Written")]
pub struct Shard {
    /// From 1.
    shard: u32,
    of: u32,
}

/// A shard as a file has it.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    shard: u32,
    of: u32,
}

/// Most pieces. Ours: more than the array of any scheduler has.
pub const SHARDS_MAX: u32 = 100_000;

impl Shard {
    /// Everything in one piece.
    pub const WHOLE: Shard = Shard { shard: 1, of: 1 };

    /// The `shard`th of so many pieces, from 1.
    ///
    /// # Errors
    /// If there is no such piece.
    pub fn new(shard: u32, of: u32) -> Result<Shard, String> {
        if !(1..=SHARDS_MAX).contains(&of) {
            return Err(format!("{of} shards: from 1 to {SHARDS_MAX} are possible"));
        }
        if !(1..=of).contains(&shard) {
            return Err(format!("there is no shard {shard} of {of}: the first is 1, the last is {of}"));
        }
        Ok(Shard { shard, of })
    }

    pub fn is_whole(self) -> bool {
        self.of == 1
    }

    /// The number of all pieces.
    pub fn count(self) -> u32 {
        self.of
    }

    /// The positions of its items, rising. `costs` has the cost of every item.
    pub fn share(self, costs: &[u64]) -> Vec<usize> {
        let shards = Shard::of_items(costs, self.of);
        (0..costs.len()).filter(|&item| shards[item] == self.shard).collect()
    }

    /// The number of the piece that each item is in. Items are dealt out by falling cost, each to the piece with the
    /// least to do so far; items of equal cost go round.
    pub fn of_items(costs: &[u64], of: u32) -> Vec<u32> {
        let mut order: Vec<usize> = (0..costs.len()).collect();
        order.sort_by_key(|&item| Reverse(costs[item]));
        let mut idle: BinaryHeap<Reverse<(u64, u32)>> = (1..=of).map(|shard| Reverse((0, shard))).collect();
        let mut shards = vec![1; costs.len()];
        for item in order {
            let Some(Reverse((cost, shard))) = idle.pop() else { break };
            shards[item] = shard;
            idle.push(Reverse((cost + costs[item], shard)));
        }
        shards
    }
}

impl TryFrom<Written> for Shard {
    type Error = String;

    fn try_from(Written { shard, of }: Written) -> Result<Shard, String> {
        Shard::new(shard, of)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Shard, String> {
        let numbers =
            text.split_once('/').and_then(|(shard, of)| Some((shard.parse().ok()?, of.parse().ok()?)));
        let (shard, of) = numbers.ok_or("it has the form `3/8`, the third of eight shards")?;
        Shard::new(shard, of)
    }
}

impl core::fmt::Display for Shard {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(formatter, "{}/{}", self.shard, self.of)
    }
}

#[cfg(test)]
mod tests {
    use avastra_lang::syntax::read_yaml;

    use super::*;

    #[test]
    fn shards_are_disjoint_and_together_all() {
        for (costs, of) in [(vec![1; 100], 7), (vec![5, 1, 1, 1, 9, 1, 400, 3], 3), (vec![2, 2], 8)] {
            let shares: Vec<Vec<usize>> =
                (1..=of).map(|shard| Shard::new(shard, of).unwrap().share(&costs)).collect();
            let mut all: Vec<usize> = shares.concat();
            all.sort_unstable();
            assert_eq!(all, (0..costs.len()).collect::<Vec<_>>());
            // No piece has more than the fair share and one item besides.
            let cost = |share: &Vec<usize>| share.iter().map(|&item| costs[item]).sum::<u64>();
            let most = shares.iter().map(cost).max().unwrap();
            let fair = costs.iter().sum::<u64>() / u64::from(of);
            assert!(most <= fair + costs.iter().max().unwrap(), "{most} of {fair}");
        }
        assert_eq!(Shard::new(2, 3).unwrap().share(&[1; 7]), [1, 4]);
    }

    #[test]
    fn shards_are_read_as_they_are_written() {
        assert_eq!("3/8".parse(), Shard::new(3, 8));
        assert_eq!(Shard::new(3, 8).unwrap().to_string(), "3/8");
        for wrong in ["", "3", "0/8", "9/8", "1/0", "a/b", "1/1000000", "-1/8"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
        assert!(read_yaml::<Shard>("shard: 9\nof: 8\n").is_err());
        let text = serde_yaml::to_string(&Shard::new(3, 8).unwrap()).unwrap();
        assert_eq!(read_yaml::<Shard>(&text).unwrap(), Shard::new(3, 8).unwrap());
    }
}
