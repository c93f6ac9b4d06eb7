//! How long a driving system thought about its answers, by the wall clock: what an owner asks first, and what tells a slow
//! program from a busy machine. It decides nothing, and no log has it.

/// Counts of answers by the time that each took, in buckets that are a twentieth wider each.
#[derive(Debug, Clone, Default)]
pub(super) struct Thoughts {
    buckets: Vec<u64>,
    answers: u64,
    /// Answers that took longer than the period between two steps, and those that came after the limit of `step`.
    beyond_period: u64,
    late: u64,
    most_s: f64,
}

/// The least time that is told apart, s.
const LEAST_S: f64 = 1e-6;
/// How much longer the times of a bucket are than those of the one before.
const GROWTH: f64 = 1.05;

/// The reported figures of the answer times.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Thinking {
    /// Answers to steps that a process gave, since avastra was started.
    pub answers: u64,
    /// Half of the answers took no longer, and 99 in 100; within 5 %.
    pub median_s: f64,
    pub most_of_99_s: f64,
    pub most_s: f64,
    /// Share of the answers that took longer than the period between two steps.
    pub beyond_period: f64,
    /// Answers that came after the limit of `step`, and were waited for.
    pub late: u64,
}

impl Thoughts {
    pub fn add(&mut self, took_s: f64, period_s: f64, limit_s: f64) {
        let bucket = (libm::log((took_s / LEAST_S).max(1.0)) / libm::log(GROWTH)) as usize;
        if self.buckets.len() <= bucket {
            self.buckets.resize(bucket + 1, 0);
        }
        self.buckets[bucket] += 1;
        self.answers += 1;
        self.beyond_period += u64::from(took_s > period_s);
        self.late += u64::from(took_s > limit_s);
        self.most_s = self.most_s.max(took_s);
    }

    /// `None` if nothing was answered.
    pub fn told(&self) -> Option<Thinking> {
        // The upper end of the bucket in which so large a share of the answers is reached.
        let within = |share: f64| {
            let wanted = (share * self.answers as f64).ceil() as u64;
            let mut seen = 0;
            let bucket = self.buckets.iter().position(|count| {
                seen += count;
                seen >= wanted
            });
            let end_s = LEAST_S * libm::pow(GROWTH, bucket.unwrap_or(0) as f64 + 1.0);
            end_s.min(self.most_s)
        };
        (self.answers > 0).then(|| Thinking {
            answers: self.answers,
            median_s: within(0.5),
            most_of_99_s: within(0.99),
            most_s: self.most_s,
            beyond_period: self.beyond_period as f64 / self.answers as f64,
            late: self.late,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_within_a_bucket_and_the_maximum_is_exact() {
        let mut thoughts = Thoughts::default();
        assert_eq!(thoughts.told(), None);
        (1..=100).for_each(|number| thoughts.add(f64::from(number) * 1e-3, 0.0905, 0.0985));
        let told = thoughts.told().expect("there are answers");
        assert!((0.050..0.0526).contains(&told.median_s), "{told:?}");
        assert!((0.099..0.1001).contains(&told.most_of_99_s), "{told:?}");
        assert_eq!((told.most_s, told.beyond_period, told.late, told.answers), (0.1, 0.1, 2, 100));
    }
}
