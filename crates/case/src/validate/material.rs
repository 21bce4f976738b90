//! What the layer is made of.

use super::super::diagnostics::Diagnostic;
use super::super::model::Material;
use super::super::quantities::Modulus;
use super::super::raw;
use super::super::reader::{Log, Read};

/// The bulk modulus as it stands in the file, if it does.
pub(super) fn bulk_modulus(raw: &raw::Material) -> Option<&Read<Modulus>> {
    match raw {
        raw::Material::MooneyRivlin(raw) => raw.bulk_modulus.as_ref(),
        raw::Material::NeoHookean(raw) => raw.bulk_modulus.as_ref(),
        raw::Material::Yeoh(raw) => raw.bulk_modulus.as_ref(),
        raw::Material::Ogden(raw) => raw.bulk_modulus.as_ref(),
    }
}

pub(super) fn material(read: &Read<raw::Material>, log: &mut Log<'_>) -> Option<Material> {
    match read.get()? {
        raw::Material::NeoHookean(raw) => {
            Some(Material::NeoHookean { shear_modulus: raw.shear_modulus.get()?.si })
        }
        raw::Material::MooneyRivlin(raw) => {
            let (c10, c01) = (raw.c10.get()?.si, raw.c01.get()?.si);
            if c10 + c01 == 0.0 {
                log.push(
                    Diagnostic::at(
                        &raw.c01.span,
                        "the layer has no stiffness: `c10` and `c01` are both zero",
                    )
                    .label("zero")
                    .related(&raw.c10.span, "zero too")
                    .help("the shear modulus 2 (c10 + c01) must be greater than zero"),
                );
                return None;
            }
            Some(Material::MooneyRivlin { c10, c01 })
        }
        raw::Material::Yeoh(raw) => {
            let optional = |read: &Option<Read<_>>| match read {
                Some(read) => Read::<super::super::quantities::SignedConstant>::get(read).map(|c| c.si),
                None => Some(0.0),
            };
            Some(Material::Yeoh { constants: [raw.c10.get()?.si, optional(&raw.c20)?, optional(&raw.c30)?] })
        }
        raw::Material::Ogden(raw) => ogden(raw, log),
    }
}

fn ogden(raw: &raw::Ogden, log: &mut Log<'_>) -> Option<Material> {
    let mut terms = Vec::new();
    for term in raw.terms.get()? {
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
    let material = Material::Ogden { terms };
    if material.shear_modulus() <= 0.0 {
        log.push(
            Diagnostic::at(&raw.terms.span, "the layer has no stiffness: its shear modulus is not positive")
                .label("the sum of mu alpha / 2 over the terms is the shear modulus")
                .help("write for example `terms = [{ mu = \"100 kPa\", alpha = 2.0 }]`"),
        );
        return None;
    }
    Some(material)
}
