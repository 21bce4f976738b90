//! `[mechanics.auto]`: chooses the model of the layer that a scene needs, with defaults for what the file
//! leaves out.
//!
//! The table is replaced by the `[mechanics.plane_strain]` or `[mechanics.solid]` that the file could have
//! had instead, before anything is checked, so that every check of those tables applies to it too.

use std::fmt;
use std::ops::Range;

use super::super::diagnostics::Diagnostic;
use super::super::quantities::{Position, Size};
use super::super::raw::{self, Document};
use super::super::reader::{Log, Read};
use super::super::values::Either;
use super::given;
use super::regions::axis_index;

/// The ratio of length along x3 to width, and to the thickness of the layer, from which a body counts as
/// long. docs/trust.md gives the error of plane strain at this length. Measured: `benches/model_errors.py`.
const LONG: f64 = 10.0;

/// The distance, in thicknesses, at which an unbounded layer is cut off beyond the indenter and the bodies in
/// the layer. Beyond a punch, four thicknesses change shear lengths by 0.2 % (`LENGTH_BEYOND_PUNCH` in
/// elastocap-mechanics).
const BEYOND: f64 = 4.0;

/// Replaces `[mechanics.auto]`, if the document has it. The result says in words which model was chosen, and
/// why.
pub(crate) fn choose(raw: &mut Document, log: &mut Log<'_>) -> Option<String> {
    let read = raw.mechanics.take()?;
    let Read { span, value: Some(raw::Mechanics::Auto(auto)) } = read else {
        raw.mechanics = Some(read);
        return None;
    };
    if raw.layer.is_none() && raw.load.is_none() {
        log.push(
            Diagnostic::at(&span, "[mechanics.auto] needs [layer]")
                .label("there is no layer to press")
                .help("add [layer], or leave [mechanics] out"),
        );
    }
    let is_complete = has_lengths(raw, &auto, &span, log);
    let chosen = Scene::of(raw, &auto).filter(|_| is_complete).and_then(|scene| scene.choose(auto));
    let (mechanics, half_length, why) = match chosen {
        Some(Chosen { mechanics, half_length, why }) => (Some(mechanics), half_length, Some(why)),
        None => (None, None, None),
    };
    if let (Some(half_length), Some(layer)) =
        (half_length, raw.layer.as_mut().and_then(|read| read.value.as_mut()))
    {
        layer.half_length = Some(Read { span: span.clone(), value: Some(Size::of(half_length)) });
    }
    raw.mechanics = Some(Read { span, value: mechanics });
    why
}

/// Whether the indenter goes all along x3; one that cannot be read counts as such.
fn presses_all_along(indenter: &Read<Either<raw::WholeTop, raw::SolidIndenter>>) -> bool {
    match indenter.get() {
        Some(Either::Second(raw::SolidIndenter::Sphere(_))) => false,
        Some(Either::Second(raw::SolidIndenter::FlatPunch(punch))) => punch.half_depth.is_none(),
        Some(Either::First(_) | Either::Second(raw::SolidIndenter::Cylinder(_))) | None => true,
    }
}

/// Checks that the lengths without a default are given: `width` where the force depends on it, and
/// `half_length` where the layer has an end or is pressed on its whole top.
fn has_lengths(raw: &Document, auto: &raw::Auto, span: &Range<usize>, log: &mut Log<'_>) -> bool {
    let lacks_width =
        auto.width.is_none() && auto.indenter.get().is_some() && presses_all_along(&auto.indenter);
    if lacks_width {
        log.push(
            Diagnostic::at(span, "[mechanics.auto] lacks `width`")
                .label(
                    "what presses goes all along x3, so that the force depends on where the layer ends there",
                )
                .help("add for example `width = \"10 mm\"`: the layer along x3, from side to side"),
        );
    }
    let lacks_half_length = given(&raw.layer).is_some_and(|layer| layer.half_length.is_none());
    let given_end = auto.end.as_ref().filter(|end| !matches!(end.get(), Some(raw::LayerEnd::Far) | None));
    let presses_whole_top = matches!(auto.indenter.get(), Some(Either::First(raw::WholeTop::WholeTop)));
    if lacks_half_length && presses_whole_top && given_end.is_none() {
        let layer = raw.layer.as_ref().map_or_else(|| span.clone(), |layer| layer.span.clone());
        log.push(
            Diagnostic::at(&layer, "[layer] lacks `half_length`")
                .label(
                    "what presses goes all along x1, so that the force depends on where the layer ends there",
                )
                .help("add for example `half_length = \"4 mm\"`: from the middle of the layer to its end"),
        );
        return false;
    }
    let end_without_length = given_end.filter(|_| lacks_half_length);
    if let Some(end) = end_without_length {
        log.push(
            Diagnostic::at(&end.span, "the layer has an end, and [layer] lacks `half_length`")
                .label("nothing says where it ends")
                .help("add for example `half_length = \"4 mm\"` to [layer], or leave `end` out: the layer then goes on"),
        );
    }
    !lacks_width && end_without_length.is_none()
}

/// The reason why a scene is not solved in plane strain.
enum NotLong {
    /// A sphere presses.
    Sphere,
    /// The ratio of the indenter's length along x3 to its width is too small.
    AgainstWidth(f64),
    /// The ratio of the indenter's length along x3 to the thickness of the layer is too small.
    AgainstThickness(f64),
    /// The ratio of the pair's length along x3 to the thickness of the layer is too small.
    Pair(f64),
    /// A body in the layer reaches beyond the indenter along x3.
    NotCovered,
}

impl fmt::Display for NotLong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let short = |f: &mut fmt::Formatter<'_>, what: &str, times: f64, than: &str| {
            write!(f, "{what} is {times:.1} times as long along x3 as {than}, and not {LONG} or more")
        };
        match self {
            Self::Sphere => f.write_str("a sphere presses"),
            Self::AgainstWidth(times) => short(f, "what presses", *times, "it is wide"),
            Self::AgainstThickness(times) => short(f, "what presses", *times, "the layer is thick"),
            Self::Pair(times) => short(f, "the pair", *times, "the layer is thick"),
            Self::NotCovered => f.write_str("what lies in the layer reaches beyond what presses along x3"),
        }
    }
}

/// The chosen model, with values for what the file left out.
struct Chosen {
    mechanics: raw::Mechanics,
    /// The half-length for the layer, m; `None` where the file gives one.
    half_length: Option<f64>,
    /// The model and the reason for it, in words.
    why: String,
}

/// The lengths that the choice depends on, m.
struct Scene {
    /// The thickness of the layer.
    thickness: f64,
    /// Whether the file gives the end of the layer along x1.
    has_half_length: bool,
    /// Half the width of the indenter, along x1; infinite for a plate over an unbounded layer.
    press_half_width: f64,
    /// The length of the indenter along x3; infinite if it goes all along an unbounded layer.
    press_length: f64,
    /// The length of the pair of electrodes along x3, if there is a pair.
    pair_length: Option<f64>,
    /// The largest distances from the middle along x1 and x3 of bodies in the layer.
    reach: [f64; 2],
}

impl Scene {
    /// Reads the lengths from a document; `None` if one of them cannot be read, which is already in the log.
    fn of(raw: &Document, auto: &raw::Auto) -> Option<Self> {
        let layer = given(&raw.layer)?;
        let thickness = layer.thickness.get()?.si;
        let si = |read: &Option<Read<Size>>| given(read).map(|size| size.si);
        // About half the width of the contact of a round indenter when it is pressed through the whole layer.
        let touched = |radius: f64| radius.min((radius * thickness).sqrt());
        let is_unbounded = matches!(given(&auto.side), Some(raw::LayerSide::Symmetric));
        let layer_width = if is_unbounded { f64::INFINITY } else { si(&auto.width).unwrap_or(0.0) };
        let (press_half_width, press_length) = match auto.indenter.get()? {
            Either::First(raw::WholeTop::WholeTop) => {
                (si(&layer.half_length).unwrap_or(f64::INFINITY), layer_width)
            }
            Either::Second(raw::SolidIndenter::FlatPunch(punch)) => {
                let length = match &punch.half_depth {
                    Some(read) => 2.0 * read.get()?.si,
                    None => layer_width,
                };
                (punch.half_width.get()?.si, length)
            }
            Either::Second(raw::SolidIndenter::Cylinder(cylinder)) => {
                (touched(cylinder.radius.get()?.si), layer_width)
            }
            Either::Second(raw::SolidIndenter::Sphere(sphere)) => {
                let radius = touched(sphere.radius.get()?.si);
                (radius, 2.0 * radius)
            }
        };
        let (pair_length, reach_of_pair) = match given(&raw.electrodes) {
            Some(forms) => length_and_reach_of_pair(forms)?,
            None => (None, [0.0; 2]),
        };
        let reach_of_bodies = reach_of_bodies(raw);
        let reach = [0, 1].map(|k| reach_of_pair[k].max(reach_of_bodies[k]));
        let has_half_length = layer.half_length.is_some();
        Some(Self { thickness, has_half_length, press_half_width, press_length, pair_length, reach })
    }

    /// Checks that everything is long along x3 and that the indenter covers the bodies in the layer.
    ///
    /// # Errors
    /// The first reason why not.
    fn is_long(&self, indenter: &Either<raw::WholeTop, raw::SolidIndenter>) -> Result<(), NotLong> {
        match indenter {
            Either::Second(raw::SolidIndenter::Sphere(_)) => return Err(NotLong::Sphere),
            Either::First(_)
            | Either::Second(raw::SolidIndenter::FlatPunch(_) | raw::SolidIndenter::Cylinder(_)) => {}
        }
        // Rubber that is pressed aside flows to the nearest side. It hardly flows along x3, as plane strain
        // requires, if the indenter is long against its own width and against the thickness of the layer.
        let [of_width, of_thickness] =
            [2.0 * self.press_half_width, self.thickness].map(|across| self.press_length / across);
        if of_width.min(of_thickness) < LONG {
            return Err(match of_width < of_thickness {
                true => NotLong::AgainstWidth(of_width),
                false => NotLong::AgainstThickness(of_thickness),
            });
        }
        if let Some(times) =
            self.pair_length.map(|length| length / self.thickness).filter(|times| *times < LONG)
        {
            return Err(NotLong::Pair(times));
        }
        if 2.0 * self.reach[1] > self.press_length {
            return Err(NotLong::NotCovered);
        }
        Ok(())
    }

    /// The model for these lengths; `None` if the indenter cannot be read.
    fn choose(&self, auto: raw::Auto) -> Option<Chosen> {
        let raw::Auto { indenter, end, width, side, relative_tolerance } = auto;
        let span = indenter.span.clone();
        let read = |value: f64| Read { span: span.clone(), value: Some(Size::of(value)) };
        let is_long = self.is_long(indenter.get()?);
        let beyond = BEYOND * self.thickness;
        let half_length = (!self.has_half_length && self.press_half_width.is_finite())
            .then(|| self.press_half_width.max(self.reach[0]) + beyond);
        let has_end = end.is_some();
        let end = end.unwrap_or_else(|| Read {
            span: span.clone(),
            value: Some(if half_length.is_some() {
                raw::LayerEnd::Far
            } else {
                raw::LayerEnd::FreeOnSubstrate
            }),
        });
        let presses_all = presses_all_along(&indenter);
        let mut assumptions = Vec::new();
        match (half_length, has_end) {
            (Some(_), _) => assumptions.push(format!(
                "the layer goes on along x1, and is cut off {BEYOND} thicknesses beyond what presses and what lies in it"
            )),
            (None, false) => assumptions.push("the layer ends at its `half_length`, above a substrate that goes on".to_owned()),
            (None, true) => {}
        }
        let (mechanics, model) = match &is_long {
            Ok(()) => {
                let width = match width {
                    Some(width) if presses_all => width,
                    _ => read(self.press_length),
                };
                let indenter = Read { span: indenter.span, value: Some(in_plane(indenter.value?)?) };
                let model = raw::PlaneStrain { indenter, end, width, relative_tolerance };
                (raw::Mechanics::PlaneStrain(model), "plane strain")
            }
            Err(_) => {
                let (width, side) = match (width, side) {
                    (Some(width), side) => (width, side),
                    (None, side) => {
                        assumptions.push(format!(
                            "the layer goes on along x3, and is cut off {BEYOND} thicknesses beyond what presses and what lies in it"
                        ));
                        let half = (0.5 * self.press_length).max(self.reach[1]) + beyond;
                        let symmetric =
                            || Read { span: span.clone(), value: Some(raw::LayerSide::Symmetric) };
                        (read(2.0 * half), Some(side.unwrap_or_else(symmetric)))
                    }
                };
                let model = raw::Solid { indenter, end, width, side, relative_tolerance };
                (raw::Mechanics::Solid(model), "three dimensions")
            }
        };
        let why = match is_long {
            Ok(()) => format!(
                "what presses is at least {LONG} times as long along x3 as it is wide and as the layer is thick{}",
                if self.pair_length.is_some() { ", and so is the pair" } else { "" }
            ),
            Err(why) => why.to_string(),
        };
        let why = [vec![format!("{model} is chosen, because {why}")], assumptions].concat().join("; ");
        Some(Chosen { mechanics, half_length, why })
    }
}

/// The plane-strain indenter for one that is long along x3; `None` for a sphere.
fn in_plane(
    indenter: Either<raw::WholeTop, raw::SolidIndenter>,
) -> Option<Either<raw::WholeTop, raw::Indenter>> {
    Some(match indenter {
        Either::First(whole_top) => Either::First(whole_top),
        Either::Second(raw::SolidIndenter::FlatPunch(punch)) => {
            let raw::SolidPunch { half_width, corner_radius, contact, .. } = punch;
            let punch = raw::FlatPunch { half_width, corner_radius, contact, position: None };
            Either::Second(raw::Indenter::FlatPunch(punch))
        }
        Either::Second(raw::SolidIndenter::Cylinder(cylinder)) => {
            let cylinder = raw::Cylinder { radius: cylinder.radius, position: None };
            Either::Second(raw::Indenter::Cylinder(cylinder))
        }
        Either::Second(raw::SolidIndenter::Sphere(_)) => return None,
    })
}

/// The length of the pair of electrodes along x3, if there is one, and its largest distances from the middle
/// along x1 and x3, m; `None` if they cannot be read.
fn length_and_reach_of_pair(forms: &raw::Electrodes) -> Option<(Option<f64>, [f64; 2])> {
    if let Some(read) = &forms.in_plane_pair {
        let pair = read.get()?;
        let width = pair.width.get()?.si;
        let reach = 0.5 * pair.gap.get()?.si + pair.length.get()?.si;
        return Some((Some(width), [reach, 0.5 * width]));
    }
    if let Some(read) = &forms.stacked_pair {
        let pair = read.get()?;
        let width = pair.width.get()?.si;
        return Some((Some(width), [0.5 * pair.length.get()?.si, 0.5 * width]));
    }
    Some((None, [0.0; 2]))
}

/// The largest distances from the middle along x1 and x3 of the boxes and sheets that move with the material
/// of the layer, m.
fn reach_of_bodies(raw: &Document) -> [f64; 2] {
    let mut reach = [0.0f64; 2];
    let mut include = |axis: usize, position: &Read<Position>| {
        if let (Some(place), Some(x)) = ([0, 2].iter().position(|plane| *plane == axis), position.get()) {
            reach[place] = reach[place].max(x.si.abs());
        }
    };
    let is_in_layer = |attached| matches!(given(attached), Some(raw::Attached::Layer));
    let conductors = given(&raw.conductor).into_iter().flatten().filter_map(Read::get);
    let conductors: Vec<_> = conductors.filter(|conductor| is_in_layer(&conductor.attached)).collect();
    let dielectrics = given(&raw.dielectric).into_iter().flatten().filter_map(Read::get);
    let dielectrics = dielectrics.filter(|dielectric| is_in_layer(&dielectric.attached));
    let single = conductors.iter().filter_map(|c| c.r#box.as_ref());
    let several = conductors.iter().filter_map(|c| given(&c.boxes)).flatten();
    let boxes = single.chain(several).chain(dielectrics.filter_map(|d| d.r#box.as_ref()));
    for region in boxes.filter_map(Read::get) {
        for corner in [&region.min, &region.max].into_iter().filter_map(Read::get) {
            corner.iter().enumerate().for_each(|(axis, position)| include(axis, position));
        }
    }
    for sheet in conductors.iter().filter_map(|c| given(&c.sheet)) {
        let Some(normal) = sheet.normal.get().map(|axis| axis_index(*axis)) else { continue };
        include(normal, &sheet.at);
        for corner in [&sheet.min, &sheet.max].into_iter().filter_map(Read::get) {
            let others = (0..3).filter(|axis| *axis != normal);
            others.zip(corner).for_each(|(axis, position)| include(axis, position));
        }
    }
    reach
}
