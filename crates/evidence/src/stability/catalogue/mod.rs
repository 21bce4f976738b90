//! The entries, by what is extreme about them.

mod gaps;
mod lengths;
mod load;
mod many;
mod margins;
mod permittivity;
mod refusals;
mod stiffness;
mod surfaces;
mod tolerances;

use super::Entry;

/// All entries, those of one subject side by side.
pub fn catalogue() -> Vec<Entry> {
    let mut entries = load::entries();
    entries.extend(stiffness::entries());
    entries.extend(permittivity::entries());
    entries.extend(gaps::entries());
    entries.extend(lengths::entries());
    entries.extend(surfaces::entries());
    entries.extend(margins::entries());
    entries.extend(refusals::entries());
    entries.extend(tolerances::entries());
    // Last: one that is given up may go on for a while and take time from those behind it.
    entries.extend(many::entries());
    entries
}
