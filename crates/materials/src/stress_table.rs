//! Measured stress of a foam over its compression, interpolated linearly.

/// A measured curve: nominal stress over compression `U/H`.
#[derive(Debug, Clone, PartialEq)]
pub struct StressTable {
    /// Compressions `U/H`, strictly rising from 0 and below 1; at least two.
    pub compression: Vec<f64>,
    /// Nominal stress in Pa at each compression while the load grows: it starts at 0 and never falls.
    pub loading: Vec<f64>,
    /// Nominal stress in Pa at each compression while the load is taken off, if that was measured.
    pub unloading: Option<Vec<f64>>,
}

/// The compressions at which a table has a given stress.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CompressionMatch {
    /// One compression `U/H`.
    At(f64),
    /// The table has the same stress between these two compressions.
    Between([f64; 2]),
    /// The stress is larger than the last one of the table.
    Beyond,
}

impl StressTable {
    /// The last compression `U/H` of the table.
    pub fn last_compression(&self) -> f64 {
        self.compression.last().copied().unwrap_or(0.0)
    }

    /// The last stress in Pa of the loading branch.
    pub fn last_stress(&self) -> f64 {
        self.loading.last().copied().unwrap_or(0.0)
    }

    /// Nominal stress in Pa of the loading branch at a compression `U/H`; `None` beyond the table.
    pub fn loading_at(&self, compression: f64) -> Option<f64> {
        self.interpolated(&self.loading, compression)
    }

    /// Nominal stress in Pa of the unloading branch at a compression `U/H`; `None` beyond the table, and
    /// without that branch.
    pub fn unloading_at(&self, compression: f64) -> Option<f64> {
        self.interpolated(self.unloading.as_deref()?, compression)
    }

    /// The compression `U/H` at which the loading branch has a nominal stress in Pa.
    pub fn compression_under(&self, stress: f64) -> CompressionMatch {
        if stress > self.last_stress() {
            return CompressionMatch::Beyond;
        }
        // The first point that has at least the stress, and the first that has more.
        let from = self.loading.partition_point(|measured| *measured < stress);
        let to = self.loading.partition_point(|measured| *measured <= stress);
        if to > from {
            let (first, last) = (self.compression[from], self.compression[to - 1]);
            return match last > first {
                true => CompressionMatch::Between([first, last]),
                false => CompressionMatch::At(first),
            };
        }
        // `from` is at least 1 here: a stress that is no point of the table lies above the first one, which
        // is 0.
        let [low, high] = [from - 1, from];
        let share = (stress - self.loading[low]) / (self.loading[high] - self.loading[low]);
        CompressionMatch::At(self.compression[low] + share * (self.compression[high] - self.compression[low]))
    }

    /// The stress of a branch at a compression, from its tabulated `stresses`; `None` beyond the table.
    fn interpolated(&self, stresses: &[f64], compression: f64) -> Option<f64> {
        let next = self.compression.partition_point(|tabulated| *tabulated < compression);
        let (end, stress_at_end) = (*self.compression.get(next)?, *stresses.get(next)?);
        if next == 0 {
            return Some(stress_at_end);
        }
        let (start, stress_at_start) = (self.compression[next - 1], stresses[next - 1]);
        let share = (compression - start) / (end - start);
        Some(stress_at_start + share * (stress_at_end - stress_at_start))
    }
}
