//! Indices as the meshers store them.

/// An optional index in four bytes, where `Option<u32>` takes eight: tables of neighbours hold millions of
/// them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct OptionalIndex(u32);

impl OptionalIndex {
    /// No index.
    pub(crate) const NONE: Self = Self(u32::MAX);

    /// An index, which must be below `u32::MAX`.
    pub(crate) fn some(index: u32) -> Self {
        debug_assert_ne!(index, u32::MAX);
        Self(index)
    }

    /// The index, if there is one.
    pub(crate) fn get(self) -> Option<u32> {
        (self != Self::NONE).then_some(self.0)
    }
}

/// Consecutive new numbers for those points that are used, in the order of their first use.
#[derive(Debug)]
pub(crate) struct Renumbering {
    /// The new number of each old one.
    numbers: Vec<OptionalIndex>,
    /// The next new number.
    next: u32,
}

impl Renumbering {
    /// A renumbering of old numbers below `count`, none of which is used yet.
    pub(crate) fn new(count: usize) -> Self {
        Self { numbers: vec![OptionalIndex::NONE; count], next: 0 }
    }

    /// The new number of `old`. At its first use it gets the next one, and `on_first_use` is called.
    pub(crate) fn number(&mut self, old: usize, on_first_use: impl FnOnce()) -> u32 {
        if let Some(number) = self.numbers[old].get() {
            return number;
        }
        on_first_use();
        let number = self.next;
        self.numbers[old] = OptionalIndex::some(number);
        self.next += 1;
        number
    }

    /// The new number of `old`, if it is used.
    pub(crate) fn get(&self, old: usize) -> Option<u32> {
        self.numbers[old].get()
    }
}
