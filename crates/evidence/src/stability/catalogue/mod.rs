//! The entries of the catalogue, by their extreme property.

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

/// All entries, grouped by subject.
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
    // These come last: an abandoned solve may continue for a while and take time from the following entries.
    entries.extend(many::entries());
    entries
}
