//! A part of the cases of a sweep, for one job among several.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// One of several parts: the cases whose index modulo `of` is `number - 1`, so that the parts take about the
/// same time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// The number of the part, counted from 1.
    pub number: usize,
    /// The number of parts.
    pub of: usize,
}

/// The error for a text that does not name a shard.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("a shard is written I/N, such as 2/4 for the second of four: I from 1 to N, N at most 1,000,000")]
pub struct ShardError;

impl Shard {
    /// The whole sweep.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// Whether a case belongs to the part.
    pub fn holds(self, index: usize) -> bool {
        index % self.of.max(1) + 1 == self.number
    }

    /// The cases of the part among `0..count`, in their order.
    pub fn cases(self, count: usize) -> impl Iterator<Item = usize> {
        (self.number.max(1) - 1..count).step_by(self.of.max(1))
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (number, of) = text.split_once('/').ok_or(ShardError)?;
        let (number, of) = (number.trim().parse().ok(), of.trim().parse().ok());
        match (number, of) {
            (Some(number), Some(of)) if (1..=of).contains(&number) && of <= 1_000_000 => {
                Ok(Self { number, of })
            }
            _ => Err(ShardError),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shards_of_a_sweep_hold_each_case_once() {
        let shards: Vec<Shard> = (1..=3).map(|number| Shard { number, of: 3 }).collect();
        let mut cases: Vec<usize> = shards.iter().flat_map(|shard| shard.cases(8)).collect();
        cases.sort_unstable();
        assert_eq!(cases, (0..8).collect::<Vec<_>>());
        assert!((0..8).all(|k| shards.iter().filter(|shard| shard.holds(k)).count() == 1));
        assert!(shards[2].cases(8).all(|k| shards[2].holds(k)));
        assert_eq!(Shard { number: 3, of: 3 }.cases(2).count(), 0);
    }

    #[test]
    fn a_shard_is_written_as_a_fraction() {
        assert_eq!("2/4".parse(), Ok(Shard { number: 2, of: 4 }));
        assert_eq!(Shard { number: 2, of: 4 }.to_string(), "2/4");
        for text in ["", "2", "0/4", "5/4", "a/b", "-1/2", "1/0", "1/9999999"] {
            assert_eq!(text.parse::<Shard>(), Err(ShardError), "{text}");
        }
    }
}
