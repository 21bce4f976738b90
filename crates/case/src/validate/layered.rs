//! Checks the layer and the electrodes in it.

use std::ops::Range;

use super::super::diagnostics::Diagnostic;
use super::super::model::{Electrodes, Extent, Face, Foam, Layer, Layout, Stiffness, Surroundings};
use super::super::quantities::Size;
use super::super::raw::{self, Document};
use super::super::reader::{Log, Read};
use super::super::values::Either;
use super::given;
use crate::material::{self, Material};

/// The layer; `None` if it is invalid or lacks what the case needs, with the reason in the log.
pub(super) fn layer(
    read: &Read<raw::Layer>,
    wants_capacitance: bool,
    wants_mechanics: bool,
    log: &mut Log<'_>,
) -> Option<Layer> {
    let raw = read.get()?;
    let foam = match &raw.foam {
        None => None,
        Some(read) => Some(foam(read, raw, log)?),
    };
    if wants_capacitance && raw.relative_permittivity.is_none() && foam.is_none() {
        log.push(
            Diagnostic::at(&read.span, "[layer] lacks `relative_permittivity`, which the capacitance needs")
                .label("a key is missing here")
                .help("add for example `relative_permittivity = 2.8`"),
        );
    }
    if wants_mechanics && raw.material.is_none() {
        log.push(
            Diagnostic::at(&read.span, "[layer] lacks a material, which [load] needs")
                .label("a table is missing here")
                .help("add for example `[layer.material.neo_hookean]` with `shear_modulus = \"100 kPa\"`"),
        );
    }
    let (material, stress_table) = match raw.material.as_ref().map(|read| material::material(read, log)) {
        Some(Some(Material::Law(law))) => (Some(law), None),
        Some(Some(Material::Measured(table))) => (None, Some(table)),
        Some(None) => return None,
        None if wants_mechanics => return None,
        None => (None, None),
    };
    let optional = |read: &Option<Read<Size>>| match read {
        Some(read) => read.get().map(|size| Some(size.si)),
        None => Some(None),
    };
    Some(Layer {
        thickness: raw.thickness.get()?.si,
        half_length: optional(&raw.half_length)?,
        relative_permittivity: match &raw.relative_permittivity {
            Some(read) => Some(read.get()?.value),
            None if foam.is_some() => foam.map(|foam| foam.relative_permittivity(1.0)),
            None if wants_capacitance => return None,
            None => None,
        },
        foam,
        bulk_modulus: match raw.material.as_ref().and_then(Read::get).and_then(material::bulk_modulus) {
            Some(read) => Some(read.get()?.si),
            None => None,
        },
        material,
        stress_table,
    })
}

/// The permittivity of a foam.
fn foam(read: &Read<raw::Foam>, layer: &raw::Layer, log: &mut Log<'_>) -> Option<Foam> {
    let table = read.get()?;
    if let Some(other) = &layer.relative_permittivity {
        log.push(
            Diagnostic::at(&read.span, "[layer] has both `foam` and `relative_permittivity`")
                .label("this says what the permittivity is")
                .related(&other.span, "and so does this")
                .help("leave one of them out"),
        );
        return None;
    }
    Some(Foam {
        solid_permittivity: table.solid_permittivity.get()?.value,
        solid_fraction: table.solid_fraction.get()?.value,
    })
}

/// The keys that the two layouts have in common.
struct Pair<'a> {
    layout: Layout,
    gap: &'a Read<Size>,
    length: &'a Read<Size>,
    thickness: &'a Read<Size>,
    width: &'a Read<Size>,
    height: &'a Read<Size>,
    shear_modulus: &'a Option<Read<raw::Stiffness>>,
}

impl<'a> Pair<'a> {
    /// The pair of a table; `None` if there is none, or it could not be read.
    fn of(raw: &'a raw::Electrodes) -> Option<Self> {
        if let Some(read) = &raw.in_plane_pair {
            let raw::InPlanePair { gap, length, thickness, width, height, shear_modulus } = read.get()?;
            return Some(Self {
                layout: Layout::InPlane,
                gap,
                length,
                thickness,
                width,
                height,
                shear_modulus,
            });
        }
        let raw::StackedPair { gap, length, thickness, width, height, shear_modulus } =
            given(&raw.stacked_pair)?;
        Some(Self { layout: Layout::Stacked, gap, length, thickness, width, height, shear_modulus })
    }
}

/// The pair of electrodes in the layer; `None` if it is invalid, with the reason in the log.
pub(super) fn electrodes(
    read: &Read<raw::Electrodes>,
    wants_mechanics: bool,
    log: &mut Log<'_>,
) -> Option<Electrodes> {
    let pair = Pair::of(read.get()?)?;
    if wants_mechanics && pair.shear_modulus.is_none() {
        log.push(
            Diagnostic::at(&read.span, "the electrodes lack `shear_modulus`, which [load] needs")
                .label("nothing says how they deform")
                .help("add for example `shear_modulus = \"1 MPa\"`, or `shear_modulus = \"rigid\"`"),
        );
        return None;
    }
    let stiffness = match pair.shear_modulus {
        None => Stiffness::Rigid,
        Some(read) => match read.get()? {
            Either::First(raw::Rigid::Rigid) => Stiffness::Rigid,
            Either::Second(modulus) => Stiffness::ShearModulus(modulus.si),
        },
    };
    Some(Electrodes {
        layout: pair.layout,
        gap: pair.gap.get()?.si,
        length: pair.length.get()?.si,
        thickness: pair.thickness.get()?.si,
        width: pair.width.get()?.si,
        height: pair.height.get()?.si,
        stiffness,
    })
}

/// The half-extent of the pair along x2.
fn half_extent(electrodes: &Electrodes) -> f64 {
    match electrodes.layout {
        Layout::InPlane => electrodes.thickness / 2.0,
        Layout::Stacked => electrodes.gap / 2.0 + electrodes.thickness,
    }
}

/// The rounding of a sum of lengths that were read from text, relative to the layer. Not tuned: it only has
/// to lie above rounding errors and below errors that matter.
const ROUNDING: f64 = 1e-12;

/// Refuses electrodes that protrude from the layer; touching a face is allowed.
pub(super) fn check_fit(
    read: &Read<raw::Electrodes>,
    electrodes: &Electrodes,
    layer: &raw::Layer,
    log: &mut Log<'_>,
) {
    let (Some(thickness), Some(raw)) = (layer.thickness.get(), read.get()) else { return };
    let total = thickness.si;
    let half = half_extent(electrodes);
    let over = electrodes.height + half - total;
    let under = half - electrodes.height;
    if over.max(under) <= ROUNDING * total {
        return;
    }
    let Some(pair) = Pair::of(raw) else { return };
    let what = match electrodes.layout {
        Layout::InPlane => "height and half the thickness",
        Layout::Stacked => "height, half the gap and the thickness",
    };
    let (side, by) = if over > under { ("top", over) } else { ("bottom", under) };
    let help = if 2.0 * half > total * (1.0 + ROUNDING) {
        format!("the electrodes need a layer of at least {}", micrometres(2.0 * half))
    } else {
        let (low, high) = (micrometres(half), micrometres(total - half));
        let right = if over > under { &high } else { &low };
        format!("write for example `height = \"{right}\"`: it must lie between {low} and {high}")
    };
    let (height, layer_text) = (log.text(&pair.height.span), log.text(&layer.thickness.span));
    log.push(
        Diagnostic::at(&pair.height.span, format!("the electrodes reach out of the layer at the {side}"))
            .label(format!("{what} at {height} overshoot by {}", micrometres(by)))
            .related(&layer.thickness.span, format!("the layer ends at {layer_text}"))
            .help(help),
    );
}

/// Refuses electrodes on a grounded face of the layer.
pub(super) fn check_shorted(
    electrodes: &Electrodes,
    layer: &raw::Layer,
    surroundings: &Surroundings,
    raw: &Document,
    log: &mut Log<'_>,
) {
    let (Extent::AroundLayer { below, above, .. }, Some(thickness)) =
        (&surroundings.extent, layer.thickness.get())
    else {
        return;
    };
    let half = half_extent(electrodes);
    let slack = ROUNDING * thickness.si;
    let at_bottom = *below == Face::Grounded && electrodes.height - half <= slack;
    let at_top = *above == Face::Grounded && electrodes.height + half >= thickness.si - slack;
    if !(at_bottom || at_top) {
        return;
    }
    let Some(pair) = given(&raw.electrodes).and_then(Pair::of) else { return };
    let side = if at_bottom { "below" } else { "above" };
    let mut diagnostic = Diagnostic::at(
        &pair.height.span,
        format!("an electrode touches the grounded plane {side} the layer, which would short it"),
    )
    .label("no layer is left between the two")
    .help(format!("move the electrodes, or give `{side}` a medium"));
    if let Some(span) = face_span(raw, at_bottom) {
        diagnostic = diagnostic.related(&span, "grounded");
    }
    log.push(diagnostic);
}

/// The place in the file that gives the medium below (or above) the layer.
fn face_span(raw: &Document, below: bool) -> Option<Range<usize>> {
    let table = given(&raw.surroundings)?;
    let face = if below { &table.below } else { &table.above };
    Some(face.as_ref().map_or_else(|| table.boundary.span.clone(), |face| face.span.clone()))
}

/// A length for messages, as a case file has it.
pub(super) fn micrometres(length: f64) -> String {
    let rounded: f64 = format!("{:.11e}", length * 1e6).parse().unwrap_or(length * 1e6);
    format!("{rounded} um")
}
