//! `[layer.material]`: the tables of the materials, their checks, and their conversion to laws.
//!
//! The doc comments of the tables are the descriptions in the JSON Schema, and address the author of a case
//! file. A new material needs a table, a line in [`MaterialTable`] and the match arms that then fail to
//! compile; nothing else in this crate.

use elastocap_materials::{HyperelasticLaw, HyperfoamTerm, StressTable};
use serde_json::Value;
use toml::de::DeValue;

use super::diagnostics::Diagnostic;
use super::quantities::{
    Compression, Constant, Exponent, Interval, Modulus, Number, NumberKind, Quantity, QuantityKind,
    SignedConstant,
};
use super::reader::{FromToml, Log, Node, Read, alternatives};
use super::tables::{Entries, TableKeys, TableSchema, choice, key, table};

choice! {
    /// The elastomer.
    enum MaterialTable {
        "mooney_rivlin" => MooneyRivlin(MooneyRivlinTable),
        "neo_hookean" => NeoHookean(NeoHookeanTable),
        "yeoh" => Yeoh(YeohTable),
        "ogden" => Ogden(OgdenTable),
        "gent" => Gent(GentTable),
        "hyperfoam" => Hyperfoam(HyperfoamTable),
        "foam_table" => FoamTable(FoamTable),
    }
}

table! {
    /// Mooney-Rivlin: W = c10 (I1 - 3) + c01 (I2 - 3), shear modulus 2 (c10 + c01).
    struct MooneyRivlinTable {
        /// c10, not negative.
        c10: Read<Constant>,
        /// c01, not negative.
        c01: Read<Constant>,
        /// Bulk modulus kappa; incompressible if not given. For finite elements only.
        bulk_modulus: Option<Read<Modulus>>,
    }
}

table! {
    /// Neo-Hookean: W = mu/2 (I1 - 3).
    struct NeoHookeanTable {
        /// Shear modulus mu.
        shear_modulus: Read<Modulus>,
        /// Bulk modulus kappa; incompressible if not given. For finite elements only.
        bulk_modulus: Option<Read<Modulus>>,
    }
}

table! {
    /// Yeoh: W = c10 (I1 - 3) + c20 (I1 - 3)^2 + c30 (I1 - 3)^3, shear modulus 2 c10. For finite elements
    /// only.
    struct YeohTable {
        /// c10.
        c10: Read<Modulus>,
        /// c20, of either sign. Default: 0.
        c20: Option<Read<SignedConstant>>,
        /// c30, of either sign. Default: 0.
        c30: Option<Read<SignedConstant>>,
        /// Bulk modulus kappa; incompressible if not given.
        bulk_modulus: Option<Read<Modulus>>,
    }
}

table! {
    /// Ogden: W = sum of mu/alpha (l1^alpha + l2^alpha + l3^alpha - 3), shear modulus sum of mu alpha / 2.
    /// For finite elements only.
    struct OgdenTable {
        /// The terms of the law.
        terms: Read<Vec<Read<OgdenTerm>>>,
        /// Bulk modulus kappa; incompressible if not given.
        bulk_modulus: Option<Read<Modulus>>,
    }
}

table! {
    /// One term of an Ogden material.
    struct OgdenTerm {
        /// mu of this term, of either sign.
        mu: Read<SignedConstant>,
        /// alpha of this term, not zero.
        alpha: Read<Exponent>,
    }
}

table! {
    /// Gent: W = -mu/2 J_m ln(1 - (I1 - 3)/J_m), shear modulus mu. For finite elements only.
    struct GentTable {
        /// Shear modulus mu.
        shear_modulus: Read<Modulus>,
        /// J_m, the value of I1 - 3 at which the chains of the rubber are fully extended; I1 is the sum of
        /// the squared principal stretches.
        limiting_invariant: Read<Number<LimitingInvariantKind>>,
        /// Bulk modulus kappa; incompressible if not given.
        bulk_modulus: Option<Read<Modulus>>,
    }
}

table! {
    /// Foam by the law of Ogden and Storakers: W = sum of 2 mu/a^2 (l1^a + l2^a + l3^a - 3 + (J^(-a b) -
    /// 1)/b) with b = nu/(1 - 2 nu). The closed form compresses it uniformly with free sides; finite elements
    /// use the law itself.
    struct HyperfoamTable {
        /// The terms of the law.
        terms: Read<Vec<Read<HyperfoamTermTable>>>,
    }
}

table! {
    /// One term of a hyperfoam.
    struct HyperfoamTermTable {
        /// mu of this term, greater than zero; the shear modulus at rest is the sum over the terms.
        shear_modulus: Read<Modulus>,
        /// a of this term, not zero.
        exponent: Read<Exponent>,
        /// nu of this term; 0 for a foam that does not widen.
        poisson_ratio: Read<Number<PoissonRatioKind>>,
    }
}

table! {
    /// Foam by its measured stress over the compression, interpolated linearly. For the closed form only,
    /// which compresses the layer uniformly and neglects its widening; a load beyond the table is refused.
    struct FoamTable {
        /// Compressions U/H of the points; they begin at 0 and rise.
        compression: Read<Vec<Read<Compression>>>,
        /// Nominal stress at each compression under growing load, the force over the area at rest; it begins
        /// at zero and never falls. The forces of the results are on this branch.
        loading: Read<Vec<Read<Constant>>>,
        /// Nominal stress at each compression under falling load, at most that under growing load. The force
        /// on this branch is a note beside the result. Default: not measured.
        unloading: Option<Read<Vec<Read<Constant>>>>,
    }
}

/// nu of a term of a hyperfoam.
#[derive(Debug, Clone, Copy)]
pub(super) struct PoissonRatioKind;
impl NumberKind for PoissonRatioKind {
    const NAME: &'static str = "a Poisson's ratio";
    const SAMPLE: &'static str = "0.0";
    const RANGE: Interval = Interval { low: 0.0, low_belongs: true, high: 0.45, high_belongs: true };
    const RULE: &'static str = "between 0 and 0.45";
    const REASON: &'static str = "soft foams have 0 to 0.3; what has more is a rubber and no foam";
}

/// J_m of a Gent material.
#[derive(Debug, Clone, Copy)]
pub(super) struct LimitingInvariantKind;
impl NumberKind for LimitingInvariantKind {
    const NAME: &'static str = "a limiting invariant";
    const SAMPLE: &'static str = "30.0";
    const RANGE: Interval = Interval { low: 0.0, low_belongs: false, high: 1e9, high_belongs: true };
    const RULE: &'static str = "greater than 0 and at most 1e9";
    const REASON: &'static str = "the largest value of I1 - 3; measured rubbers have 1 to 200";
}

/// The bulk modulus in the file, if it is given.
pub(super) fn bulk_modulus(table: &MaterialTable) -> Option<&Read<Modulus>> {
    match table {
        MaterialTable::MooneyRivlin(table) => table.bulk_modulus.as_ref(),
        MaterialTable::NeoHookean(table) => table.bulk_modulus.as_ref(),
        MaterialTable::Yeoh(table) => table.bulk_modulus.as_ref(),
        MaterialTable::Ogden(table) => table.bulk_modulus.as_ref(),
        MaterialTable::Gent(table) => table.bulk_modulus.as_ref(),
        MaterialTable::Hyperfoam(_) | MaterialTable::FoamTable(_) => None,
    }
}

/// Whether the material is incompressible.
pub(super) fn keeps_volume(table: &MaterialTable) -> bool {
    bulk_modulus(table).is_none() && !is_foam(table)
}

/// Whether the material is a foam law.
pub(super) fn is_foam(table: &MaterialTable) -> bool {
    matches!(table, MaterialTable::Hyperfoam(_) | MaterialTable::FoamTable(_))
}

/// Whether the material is a foam that does not widen under compression.
pub(super) fn gets_no_wider(table: &MaterialTable) -> bool {
    let MaterialTable::Hyperfoam(table) = table else { return false };
    let mut terms = table.terms.get().into_iter().flatten().filter_map(Read::get);
    terms.all(|term| term.poisson_ratio.get().is_some_and(|ratio| ratio.value == 0.0))
}

/// The name of the material, with its article, if the closed form of the layer does not cover it.
pub(super) fn without_closed_form(table: &MaterialTable) -> Option<&'static str> {
    match table {
        MaterialTable::MooneyRivlin(_)
        | MaterialTable::NeoHookean(_)
        | MaterialTable::Hyperfoam(_)
        | MaterialTable::FoamTable(_) => None,
        MaterialTable::Yeoh(_) => Some("a Yeoh material"),
        MaterialTable::Ogden(_) => Some("an Ogden material"),
        MaterialTable::Gent(_) => Some("a Gent material"),
    }
}

/// The material of a layer.
pub(super) enum Material {
    /// A law of hyperelasticity.
    Law(HyperelasticLaw),
    /// The measured stress of a foam.
    Measured(StressTable),
}

/// The material; `None` if it is invalid, with the reason in the log.
pub(super) fn material(read: &Read<MaterialTable>, log: &mut Log<'_>) -> Option<Material> {
    match read.get()? {
        MaterialTable::FoamTable(table) => stress_table(table, log).map(Material::Measured),
        table => law(table, log).map(Material::Law),
    }
}

/// The law of the material; `None` for a table of stresses, and if it is invalid, with the reason in the log.
fn law(table: &MaterialTable, log: &mut Log<'_>) -> Option<HyperelasticLaw> {
    match table {
        MaterialTable::NeoHookean(table) => {
            Some(HyperelasticLaw::NeoHookean { shear_modulus: table.shear_modulus.get()?.si })
        }
        MaterialTable::MooneyRivlin(table) => mooney_rivlin(table, log),
        MaterialTable::Yeoh(table) => Some(HyperelasticLaw::Yeoh {
            constants: [
                table.c10.get()?.si,
                si_or_zero(table.c20.as_ref())?,
                si_or_zero(table.c30.as_ref())?,
            ],
        }),
        MaterialTable::Ogden(table) => ogden(table, log),
        MaterialTable::Gent(table) => Some(HyperelasticLaw::Gent {
            shear_modulus: table.shear_modulus.get()?.si,
            limiting_invariant: table.limiting_invariant.get()?.value,
        }),
        MaterialTable::Hyperfoam(table) => hyperfoam(table, log),
        MaterialTable::FoamTable(_) => None,
    }
}

/// The law of a hyperfoam; `None` if it is invalid, with the reason in the log.
fn hyperfoam(table: &HyperfoamTable, log: &mut Log<'_>) -> Option<HyperelasticLaw> {
    let mut terms = Vec::new();
    for term in table.terms.get()? {
        let term = term.get()?;
        let exponent = term.exponent.get()?.value;
        if exponent == 0.0 {
            log.push(
                Diagnostic::at(&term.exponent.span, "`exponent` of a hyperfoam term must not be zero")
                    .label("zero")
                    .help("write for example `exponent = 8.0`: the larger it is, the flatter the plateau"),
            );
            return None;
        }
        terms.push(HyperfoamTerm {
            shear_modulus: term.shear_modulus.get()?.si,
            exponent,
            poisson_ratio: term.poisson_ratio.get()?.value,
        });
    }
    if terms.is_empty() {
        log.push(
            Diagnostic::at(&table.terms.span, "the layer has no stiffness: `terms` is empty")
                .label("no term")
                .help("write for example `terms = [{ shear_modulus = \"15 kPa\", exponent = 8.0, poisson_ratio = 0.0 }]`"),
        );
        return None;
    }
    Some(HyperelasticLaw::Hyperfoam { terms })
}

/// The measured stress of a foam; `None` if it is invalid, with the reason in the log.
fn stress_table(table: &FoamTable, log: &mut Log<'_>) -> Option<StressTable> {
    let stresses = |read: &Read<Vec<Read<Constant>>>| -> Option<Vec<f64>> {
        read.get()?.iter().map(|entry| Some(entry.get()?.si)).collect()
    };
    let compressions = table.compression.get()?;
    let compression: Vec<f64> = compressions.iter().map(|c| Some(c.get()?.value)).collect::<Option<_>>()?;
    let branches = [("loading", Some(&table.loading)), ("unloading", table.unloading.as_ref())];
    let branches = branches.into_iter().filter_map(|(name, read)| Some((name, read?)));
    let mut read_branches = Vec::new();
    for (name, read) in branches {
        let values = stresses(read)?;
        if values.len() != compression.len() {
            let (stresses, points) = (values.len(), compression.len());
            log.push(
                Diagnostic::at(
                    &read.span,
                    format!("`{name}` has {stresses} stresses, and `compression` has {points} entries"),
                )
                .label("one stress for each compression is needed")
                .related(&table.compression.span, "the compressions")
                .help("give both lists the same number of entries"),
            );
            return None;
        }
        read_branches.push((values, read));
    }
    if compression.len() < 2 || compression.first() != Some(&0.0) {
        log.push(
            Diagnostic::at(
                &table.compression.span,
                "the table of a foam begins at a compression of 0 and has two points or more",
            )
            .label("the layer at rest is missing, or all but it")
            .help("begin with `compression = [0.0, ..` and `loading = [\"0 kPa\", ..`"),
        );
        return None;
    }
    if let Some(k) = (1..compression.len()).find(|k| compression[*k] <= compression[k - 1]) {
        log.push(
            Diagnostic::at(&compressions[k].span, "the compressions of a foam's table do not rise")
                .label("not larger than the one before")
                .help("sort the points by their compression, and leave out what is measured twice"),
        );
        return None;
    }
    for (values, read) in &read_branches {
        let entries = read.get()?;
        if values[0] != 0.0 {
            log.push(
                Diagnostic::at(&entries[0].span, "the table of a foam begins with a stress of zero")
                    .label("the layer is at rest here")
                    .help(
                        "take the stress of the first contact off all stresses, and write `\"0 kPa\"` here",
                    ),
            );
            return None;
        }
        if let Some(k) = (1..values.len()).find(|k| values[*k] < values[k - 1]) {
            log.push(
                Diagnostic::at(&entries[k].span, "the stresses of a foam's table fall")
                    .label("less than the one before: a force would have several compressions")
                    .help("smooth the measurement until no stress is less than the one before"),
            );
            return None;
        }
    }
    let mut branches = read_branches.into_iter().map(|(values, _)| values);
    let loading = branches.next()?;
    let unloading = branches.next();
    if loading.iter().all(|stress| *stress == 0.0) {
        log.push(
            Diagnostic::at(&table.loading.span, "the layer has no stiffness: all stresses are zero")
                .label("zero throughout")
                .help("give the measured stress at each compression"),
        );
        return None;
    }
    let first_above = |unloading: &Vec<f64>| (0..loading.len()).find(|k| unloading[*k] > loading[*k]);
    if let (Some(k), Some(read)) = (unloading.as_ref().and_then(first_above), &table.unloading) {
        log.push(
            Diagnostic::at(
                &read.get()?[k].span,
                "a foam cannot give back more than it takes: `unloading` is above `loading`",
            )
            .label("more than the stress of loading at this compression")
            .related(&table.loading.get()?[k].span, "the stress of loading")
            .help("check whether the two lists are exchanged"),
        );
        return None;
    }
    Some(StressTable { compression, loading, unloading })
}

/// The value in SI units, zero where the file does not give it; `None` if it is invalid.
fn si_or_zero<K: QuantityKind>(read: Option<&Read<Quantity<K>>>) -> Option<f64>
where
    Quantity<K>: FromToml,
{
    read.map_or(Some(0.0), |read| read.get().map(|constant| constant.si))
}

fn mooney_rivlin(table: &MooneyRivlinTable, log: &mut Log<'_>) -> Option<HyperelasticLaw> {
    let (c10, c01) = (table.c10.get()?.si, table.c01.get()?.si);
    if c10 + c01 == 0.0 {
        log.push(
            Diagnostic::at(&table.c01.span, "the layer has no stiffness: `c10` and `c01` are both zero")
                .label("zero")
                .related(&table.c10.span, "zero too")
                .help("the shear modulus 2 (c10 + c01) must be greater than zero"),
        );
        return None;
    }
    Some(HyperelasticLaw::MooneyRivlin { c10, c01 })
}

fn ogden(table: &OgdenTable, log: &mut Log<'_>) -> Option<HyperelasticLaw> {
    let mut terms = Vec::new();
    for term in table.terms.get()? {
        let term = term.get()?;
        let (mu, alpha) = (term.mu.get()?.si, term.alpha.get()?.value);
        if alpha == 0.0 {
            log.push(
                Diagnostic::at(&term.alpha.span, "`alpha` of an Ogden term must not be zero")
                    .label("zero")
                    .help("write for example `alpha = 2.0`, the exponent of a neo-Hookean material"),
            );
            return None;
        }
        terms.push((mu, alpha));
    }
    let law = HyperelasticLaw::Ogden { terms };
    if law.shear_modulus() <= 0.0 {
        log.push(
            Diagnostic::at(
                &table.terms.span,
                "the layer has no stiffness: its shear modulus is not positive",
            )
            .label("the sum of mu alpha / 2 over the terms is the shear modulus")
            .help("write for example `terms = [{ mu = \"100 kPa\", alpha = 2.0 }]`"),
        );
        return None;
    }
    Some(law)
}
