//! A learner as bytes, whole: restored, it goes on as if it had never stopped. Each of its parts writes and reads itself.
//!
//! Settings are not among them: a checkpoint belongs to a run, and the run knows them.

/// The first bytes of every checkpoint; the number rises when the layout changes.
const MAGIC: &[u8; 8] = b"avackpt1";

/// Writes little-endian numbers. Lists come without their length, which the reader knows.
pub(super) struct Writer(Vec<u8>);

impl Writer {
    /// The beginning of a checkpoint.
    pub fn new() -> Writer {
        Writer(MAGIC.to_vec())
    }

    pub fn into_bytes(self) -> Vec<u8> {
        self.0
    }

    pub fn u64(&mut self, value: u64) {
        self.0.extend(value.to_le_bytes());
    }

    pub fn f32s(&mut self, values: &[f32]) {
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }

    pub fn f64s(&mut self, values: &[f64]) {
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }

    pub fn flags(&mut self, values: &[bool]) {
        self.0.extend(values.iter().map(|&value| u8::from(value)));
    }
}

/// Reads what [`Writer`] wrote; `None` if too few bytes are left.
pub(super) struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    /// Behind the beginning of a checkpoint; `None` if it is none.
    pub fn new(bytes: &'a [u8]) -> Option<Reader<'a>> {
        bytes.strip_prefix(MAGIC).map(Reader)
    }

    pub fn is_at_end(&self) -> bool {
        self.0.is_empty()
    }

    fn take(&mut self, count: usize) -> Option<&[u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    pub fn u64(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }

    pub fn f32s(&mut self, count: usize) -> Option<Vec<f32>> {
        let (values, _) = self.take(count.checked_mul(4)?)?.as_chunks();
        Some(values.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect())
    }

    pub fn f64s(&mut self, count: usize) -> Option<Vec<f64>> {
        let (values, _) = self.take(count.checked_mul(8)?)?.as_chunks();
        Some(values.iter().map(|&bytes| f64::from_le_bytes(bytes)).collect())
    }

    pub fn flags(&mut self, count: usize) -> Option<Vec<bool>> {
        Some(self.take(count)?.iter().map(|&byte| byte != 0).collect())
    }
}
