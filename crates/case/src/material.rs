//! `[layer.material]`: the tables of the elastomers as they are written, what they are checked for, and what they become.
//!
//! The doc comments of the tables are the descriptions in the JSON Schema, so they speak to whoever writes a case file. A new
//! material needs a table, a line in [`MaterialTable`] and the match arms that then fail to compile; nothing else in this crate.

use elastocap_materials::HyperelasticLaw;
use serde_json::Value;
use toml::de::DeValue;

use super::diagnostics::Diagnostic;
use super::quantities::{
    Constant, Exponent, Interval, Modulus, Number, NumberKind, Quantity, QuantityKind, SignedConstant,
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
    /// Yeoh: W = c10 (I1 - 3) + c20 (I1 - 3)^2 + c30 (I1 - 3)^3, shear modulus 2 c10. For finite elements only.
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
    /// Ogden: W = sum of mu/alpha (l1^alpha + l2^alpha + l3^alpha - 3), shear modulus sum of mu alpha / 2. For finite
    /// elements only.
    struct OgdenTable {
        /// Its terms.
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
        /// J_m, the value of I1 - 3 at which the chains of the rubber are fully extended; I1 is the sum of the squared
        /// principal stretches.
        limiting_invariant: Read<Number<LimitingInvariantKind>>,
        /// Bulk modulus kappa; incompressible if not given.
        bulk_modulus: Option<Read<Modulus>>,
    }
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

/// The bulk modulus as it stands in the file, if it does.
pub(super) fn bulk_modulus(table: &MaterialTable) -> Option<&Read<Modulus>> {
    match table {
        MaterialTable::MooneyRivlin(table) => table.bulk_modulus.as_ref(),
        MaterialTable::NeoHookean(table) => table.bulk_modulus.as_ref(),
        MaterialTable::Yeoh(table) => table.bulk_modulus.as_ref(),
        MaterialTable::Ogden(table) => table.bulk_modulus.as_ref(),
        MaterialTable::Gent(table) => table.bulk_modulus.as_ref(),
    }
}

/// What the material is called, with its article, if the closed form of the layer does not cover it.
pub(super) fn without_closed_form(table: &MaterialTable) -> Option<&'static str> {
    match table {
        MaterialTable::MooneyRivlin(_) | MaterialTable::NeoHookean(_) => None,
        MaterialTable::Yeoh(_) => Some("a Yeoh material"),
        MaterialTable::Ogden(_) => Some("an Ogden material"),
        MaterialTable::Gent(_) => Some("a Gent material"),
    }
}

/// The law of the material; `None` after a message to `log`.
pub(super) fn material(read: &Read<MaterialTable>, log: &mut Log<'_>) -> Option<HyperelasticLaw> {
    match read.get()? {
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
    }
}

/// The value in SI units, zero where the file does not give it.
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
