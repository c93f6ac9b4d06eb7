//! A learner as bytes, whole: restored, it goes on as if it had never stopped.
//!
//! Settings are not among them: a checkpoint belongs to a run, and the run knows them.

use super::learner::Learner;
use super::replay::{Replay, Transition};

/// The first bytes of every checkpoint; the number rises when the layout changes.
const MAGIC: &[u8; 8] = b"avackpt1";

impl Learner {
    /// Everything that the learner has learned and still remembers.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Writer(MAGIC.to_vec());
        bytes.u64(self.steps);
        bytes.u64(self.updates);
        bytes.f64s(&self.policy.quirks.random_weights);
        bytes.f32s(self.policy.network.parameters());
        bytes.f32s(self.target.parameters());
        if let Some(average) = &self.average {
            bytes.f32s(average.network.parameters());
        }
        bytes.f32s(&self.adam.mean);
        bytes.f32s(&self.adam.square);
        bytes.f64s(&[self.adam.mean_power, self.adam.square_power]);
        let (items, next, priority_max) = self.replay.contents();
        bytes.u64(self.replay.len() as u64);
        bytes.u64(next as u64);
        bytes.f64s(&[priority_max]);
        for (transition, priority) in items {
            bytes.f64s(&[priority]);
            bytes.f32s(&transition.inputs);
            bytes.u64(u64::from(transition.row));
            bytes.f32s(&[transition.reward, transition.discount]);
            bytes.f32s(&transition.next_inputs);
            bytes.flags(&transition.next_legal);
        }
        bytes.0
    }

    /// A new learner as the one that was saved; `None` if the bytes are not those of a learner with such settings
    /// and rows.
    pub(super) fn restored(self, bytes: &[u8]) -> Option<Learner> {
        let mut learner = self;
        let (parameters, inputs) = (learner.target.parameters().len(), learner.policy.features.len());
        let rows = learner.policy.rows.allowed.len();
        let mut bytes = Reader(bytes.strip_prefix(MAGIC)?);
        learner.steps = bytes.u64()?;
        learner.updates = bytes.u64()?;
        learner.policy.quirks.random_weights = bytes.f64s(rows)?;
        learner.policy.network.parameters_mut().copy_from_slice(&bytes.f32s(parameters)?);
        learner.target.parameters_mut().copy_from_slice(&bytes.f32s(parameters)?);
        if let Some(average) = &mut learner.average {
            average.network.parameters_mut().copy_from_slice(&bytes.f32s(parameters)?);
        }
        (learner.adam.mean, learner.adam.square) = (bytes.f32s(parameters)?, bytes.f32s(parameters)?);
        let powers = bytes.f64s(2)?;
        (learner.adam.mean_power, learner.adam.square_power) = (powers[0], powers[1]);
        let (count, next) = (bytes.u64()?, bytes.u64()?);
        let priority_max = bytes.f64s(1)?[0];
        let mut items = Vec::new();
        for _ in 0..count {
            let priority = bytes.f64s(1)?[0];
            let sight = bytes.f32s(inputs)?;
            let row = u32::try_from(bytes.u64()?).ok()?;
            let figures = bytes.f32s(2)?;
            let next_inputs = bytes.f32s(inputs)?;
            let next_legal = bytes.flags(rows)?;
            let (reward, discount) = (figures[0], figures[1]);
            let transition = Transition { inputs: sight, row, reward, discount, next_inputs, next_legal };
            items.push((transition, priority));
        }
        let settings = learner.policy.settings().replay;
        learner.replay = Replay::restored(settings, items, next, priority_max)?;
        bytes.0.is_empty().then_some(learner)
    }
}

/// Writes little-endian numbers. Lists come without their length, which the reader knows.
struct Writer(Vec<u8>);

impl Writer {
    fn u64(&mut self, value: u64) {
        self.0.extend(value.to_le_bytes());
    }

    fn f32s(&mut self, values: &[f32]) {
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }

    fn f64s(&mut self, values: &[f64]) {
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }

    fn flags(&mut self, values: &[bool]) {
        self.0.extend(values.iter().map(|&value| u8::from(value)));
    }
}

/// Reads what [`Writer`] wrote; `None` if too few bytes are left.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take(&mut self, count: usize) -> Option<&[u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn u64(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }

    fn f32s(&mut self, count: usize) -> Option<Vec<f32>> {
        let (values, _) = self.take(count.checked_mul(4)?)?.as_chunks();
        Some(values.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect())
    }

    fn f64s(&mut self, count: usize) -> Option<Vec<f64>> {
        let (values, _) = self.take(count.checked_mul(8)?)?.as_chunks();
        Some(values.iter().map(|&bytes| f64::from_le_bytes(bytes)).collect())
    }

    fn flags(&mut self, count: usize) -> Option<Vec<bool>> {
        Some(self.take(count)?.iter().map(|&byte| byte != 0).collect())
    }
}
