//! Expands standard electrode forms into conductors.
//!
//! A form becomes the [[conductor]] tables that the file could have had instead, before anything is checked:
//! names, gaps and faces are then checked as those of all other conductors, and messages point to the form.

use std::ops::Range;

use super::super::diagnostics::{Diagnostic, shown};
use super::super::quantities::{Charge, Height, Position, Size};
use super::super::raw::{self, Document};
use super::super::reader::{Log, Read};
use super::super::values::{Count, Either, Text};
use super::given;

/// The largest number of pads, fingers or sides in one form.
const MOST_PARTS: u32 = 500;

/// A rectangle in the plane of a form: its lower and its upper corner along x1 and x3, m.
type Rectangle = [[f64; 2]; 2];

/// Expands the forms of a document into conductors, before its own conductors.
pub(crate) fn write_out(raw: &mut Document, log: &mut Log<'_>) {
    let Some(forms) = given(&raw.electrodes) else { return };
    check_one_pair(forms, log);
    let thickness = given(&raw.layer).and_then(|layer| layer.thickness.get()).map(|h| h.si);
    let mut writer = Writer { thickness, conductors: Vec::new(), guards: Vec::new() };
    for comb in each(&forms.comb) {
        writer.comb(comb, log);
    }
    for array in each(&forms.array) {
        writer.array(array, log);
    }
    for spiral in each(&forms.spiral) {
        writer.spiral(spiral, log);
    }
    for ring in each(&forms.ring) {
        writer.ring(ring, log);
    }
    let Writer { conductors, guards, .. } = writer;
    if conductors.is_empty() {
        return;
    }
    let span = raw.electrodes.as_ref().map_or(0..0, |read| read.span.clone());
    let is_on_terminal = |name: &str| {
        let terminals = given(&raw.terminal).into_iter().flatten().filter_map(Read::get);
        let names = terminals.flat_map(|terminal| terminal.conductors.get().into_iter().flatten());
        names.filter_map(Read::get).any(|text| text.0 == name)
    };
    let guards: Vec<Read<raw::Terminal>> = guards
        .into_iter()
        .filter(|(name, _)| !is_on_terminal(name))
        .map(|(name, span)| grounded(&name, &span))
        .collect();
    put_before(&mut raw.conductor, conductors, &span);
    if !guards.is_empty() {
        put_before(&mut raw.terminal, guards, &span);
    }
}

/// Puts entries before those of an array, unless the array could not be read.
fn put_before<T>(array: &mut Option<Read<Vec<T>>>, mut entries: Vec<T>, span: &Range<usize>) {
    let read = array.get_or_insert_with(|| Read { span: span.clone(), value: Some(Vec::new()) });
    if let Some(existing) = &mut read.value {
        entries.append(existing);
        *existing = entries;
    }
}

/// The grounded terminal of a guard, which shields.
fn grounded(name: &str, span: &Range<usize>) -> Read<raw::Terminal> {
    let text = || read_at(span, Text(name.to_owned()));
    let terminal = raw::Terminal {
        name: text(),
        conductors: read_at(span, vec![text()]),
        potential: Some(read_at(span, raw::TerminalPotential::Ground)),
        follows: None,
    };
    read_at(span, terminal)
}

/// Every table of a form that could be read, with its place in the file.
fn each<T>(form: &Option<Read<raw::OneOrMore<T>>>) -> Vec<(&T, &Range<usize>)> {
    let Some(read) = form else { return Vec::new() };
    match read.get() {
        Some(Either::First(tables)) => {
            tables.iter().filter_map(|read| Some((read.get()?, &read.span))).collect()
        }
        Some(Either::Second(table)) => vec![(table, &read.span)],
        None => Vec::new(),
    }
}

/// Refuses a second pair of electrodes.
fn check_one_pair(forms: &raw::Electrodes, log: &mut Log<'_>) {
    if let (Some(first), Some(second)) = (&forms.in_plane_pair, &forms.stacked_pair) {
        let [first, second] = match first.span.start < second.span.start {
            true => [&first.span, &second.span],
            false => [&second.span, &first.span],
        };
        log.push(
            Diagnostic::at(second, "[electrodes] has both `in_plane_pair` and `stacked_pair`")
                .label("this one is too many")
                .related(first, "beside this")
                .help(
                    "keep one of the two; write the other as [[conductor]] tables, or as a comb or an array",
                ),
        );
    }
}

/// The name, place and attachment that all forms have.
struct Frame<'a> {
    name: String,
    /// The place of the form in the file.
    span: &'a Range<usize>,
    /// The range along x2, m.
    x2: [f64; 2],
    /// The centre along x1 and x3, m.
    center: [f64; 2],
    attached: Option<raw::Attached>,
}

impl Frame<'_> {
    /// A value that points to the form as its place in the file.
    fn read<T>(&self, value: T) -> Read<T> {
        read_at(self.span, value)
    }
}

/// A value with this place in the file.
fn read_at<T>(span: &Range<usize>, value: T) -> Read<T> {
    Read { span: span.clone(), value: Some(value) }
}

/// Collects the conductors that forms stand for.
struct Writer {
    /// The thickness of the layer, m, if the document has one.
    thickness: Option<f64>,
    conductors: Vec<Read<raw::Conductor>>,
    /// The names of guards, with the places of their forms in the file.
    guards: Vec<(String, Range<usize>)>,
}

/// The keys that give the place of a form.
struct Place<'a> {
    name: &'a Option<Read<Text>>,
    default_name: &'a str,
    on: &'a Option<Read<raw::On>>,
    height: &'a Option<Read<Position>>,
    thickness: &'a Read<Height>,
    center: &'a Option<Read<[Read<Position>; 2]>>,
}

/// The place of a form, from the keys that all forms have.
macro_rules! place {
    ($form:expr, $default_name:expr) => {
        Place {
            name: &$form.name,
            default_name: $default_name,
            on: &$form.on,
            height: &$form.height,
            thickness: &$form.thickness,
            center: &$form.center,
        }
    };
}

impl Writer {
    /// Expands two combs: fingers from one bus each; the bus of the first comb is at the lower x3.
    fn comb(&mut self, (comb, span): (&raw::Comb, &Range<usize>), log: &mut Log<'_>) -> Option<()> {
        let frame = self.frame(&place!(comb, "comb"), span, log)?;
        let fingers = count(&comb.fingers, 2, "a comb has at least two fingers", log)?;
        let [width, gap, overlap] = [si(&comb.finger_width)?, si(&comb.gap)?, si(&comb.overlap)?];
        let [end_gap, bus] = [si(&comb.end_gap)?, si(&comb.bus_width)?];
        let pitch = width + gap;
        let half = 0.5 * (f64::from(fingers - 1) * pitch + width);
        let (tip, inner) = (0.5 * overlap, 0.5 * overlap + end_gap);
        for (number, side) in [(1, -1.0), (2, 1.0)] {
            // For the second comb; the first is its mirror image.
            let along = |from: f64, to: f64| if side > 0.0 { [from, to] } else { [-to, -from] };
            let mut parts = vec![rectangle([-half, half], along(inner, inner + bus))];
            for finger in (number - 1..fingers).step_by(2) {
                let left = f64::from(finger) * pitch - half;
                parts.push(rectangle([left, left + width], along(-tip, inner)));
            }
            self.rectangles(&frame, &format!("{}-{number}", frame.name), &parts);
        }
        self.guard(&frame, &comb.guard, [half, inner + bus])
    }

    /// Expands an array into its pads, and into their common plate if it has one.
    fn array(&mut self, (array, span): (&raw::Array, &Range<usize>), log: &mut Log<'_>) -> Option<()> {
        let frame = self.frame(&place!(array, "pad"), span, log)?;
        let [rows, columns] = array.pads.get()?;
        let counts =
            [rows, columns].map(|read| count(read, 1, "an array has at least one pad each way", log));
        let counts = [counts[0]?, counts[1]?];
        if counts[0] * counts[1] > MOST_PARTS {
            too_many(&array.pads.span, "pads", log);
            return None;
        }
        let [pitch1, pitch3] = array.pitch.get()?;
        let pitch = [si(pitch1)?, si(pitch3)?];
        let size = match (&array.size, &array.diameter) {
            (Some(read), None) => {
                let [along1, along3] = read.get()?;
                [si(along1)?, si(along3)?]
            }
            (None, Some(read)) => [si(read)?; 2],
            (first, _) => {
                let place = first.as_ref().map_or(span, |read| &read.span);
                let message = match first {
                    Some(_) => "pads have either a `size` or a `diameter`",
                    None => "the pads of an array lack `size` or `diameter`",
                };
                log.push(
                    Diagnostic::at(place, message)
                        .label("the shape of the pads is not known")
                        .help("write for example `size = [\"3 mm\", \"3 mm\"]`, or `diameter = \"3 mm\"`"),
                );
                return None;
            }
        };
        let half = [0, 1].map(|k| 0.5 * (f64::from(counts[k] - 1) * pitch[k] + size[k]));
        for i in 0..counts[0] {
            for j in 0..counts[1] {
                let middle = [(i, 0), (j, 1)].map(|(n, k)| {
                    // Both halves of an array are exact mirror images.
                    0.5 * (2.0 * f64::from(n) - f64::from(counts[k] - 1)) * pitch[k]
                });
                let name = format!("{}-{}-{}", frame.name, i + 1, j + 1);
                match &array.diameter {
                    Some(read) => self.disc(&frame, &name, middle, read, &array.inner_diameter, log)?,
                    None => {
                        let sides = [0, 1].map(|k| [middle[k] - 0.5 * size[k], middle[k] + 0.5 * size[k]]);
                        self.rectangles(&frame, &name, &[rectangle(sides[0], sides[1])]);
                    }
                }
            }
        }
        if let Some(read) = &array.common_plate {
            let plate = read.get()?;
            let place = Place {
                on: &plate.on,
                height: &plate.height,
                thickness: &plate.thickness,
                ..place!(array, "pad")
            };
            let plate_frame = self.frame(&place, &read.span, log)?;
            let margin = match &plate.margin {
                Some(read) => read.get()?.si,
                None => 0.0,
            };
            let sides = half.map(|half| [-half - margin, half + margin]);
            let name = format!("{}-plate", frame.name);
            self.rectangles(&plate_frame, &name, &[rectangle(sides[0], sides[1])]);
            if let (Some(read), Some(last)) =
                (&plate.charge, self.conductors.last_mut().and_then(|c| c.value.as_mut()))
            {
                last.charge =
                    Some(Read { span: read.span.clone(), value: read.get().map(|c| Charge::of(c.si)) });
            }
        }
        self.guard(&frame, &array.guard, half)
    }

    /// Expands spirals, whose sides grow by a quarter of the distance between the turns of an arm from one to
    /// the next.
    fn spiral(&mut self, (spiral, span): (&raw::Spiral, &Range<usize>), log: &mut Log<'_>) -> Option<()> {
        let frame = self.frame(&place!(spiral, "spiral"), span, log)?;
        let arms = match &spiral.arms {
            Some(read) => match read.get()?.0 {
                arms @ (1 | 2) => arms,
                _ => {
                    log.push(
                        Diagnostic::at(&read.span, "a spiral has one arm or two")
                            .label("neither 1 nor 2")
                            .help("write `arms = 2` for two that lie within one another"),
                    );
                    return None;
                }
            },
            None => 2,
        };
        let turns = count(&spiral.turns, 1, "a spiral has at least one turn", log)?;
        let [width, gap, inner] = [si(&spiral.trace_width)?, si(&spiral.gap)?, si(&spiral.inner)?];
        let growth = 0.25 * f64::from(arms) * (width + gap);
        // Two arms begin at the distance `inner` on opposite sides of the centre.
        if inner < 0.5 * width || (arms == 2 && 2.0 * inner < width + gap) {
            log.push(
                Diagnostic::at(&spiral.inner.span, "the innermost traces of the spiral touch")
                    .label("too close to the centre")
                    .help("make `inner` larger"),
            );
            return None;
        }
        let distance = |side: u32| inner + f64::from(side) * growth;
        let arm = |sign: f64| -> Vec<Rectangle> {
            let side = |n: u32| {
                // Directions +x1, +x3, -x1, -x3 from the centre; the trace runs across from the side before
                // to the one after.
                let before = if n == 0 { 0.0 } else { distance(n - 1) + 0.5 * width };
                let (near, far) = (distance(n) - 0.5 * width, distance(n) + 0.5 * width);
                let after = distance(n + 1) + 0.5 * width;
                let [x1, x3] = match n % 4 {
                    0 => [[near, far], [-before, after]],
                    1 => [[-after, before], [near, far]],
                    2 => [[-far, -near], [-after, before]],
                    _ => [[-before, after], [-far, -near]],
                };
                let turned = |[low, high]: [f64; 2]| if sign > 0.0 { [low, high] } else { [-high, -low] };
                rectangle(turned(x1), turned(x3))
            };
            (0..4 * turns).map(side).collect()
        };
        match arms {
            1 => self.rectangles(&frame, &frame.name, &arm(1.0)),
            _ => {
                for (number, sign) in [(1, 1.0), (2, -1.0)] {
                    self.rectangles(&frame, &format!("{}-{number}", frame.name), &arm(sign));
                }
            }
        }
        self.guard(&frame, &spiral.guard, [distance(4 * turns) + 0.5 * width; 2])
    }

    /// Expands a ring or disc, with a ring as its guard.
    fn ring(&mut self, (ring, span): (&raw::Ring, &Range<usize>), log: &mut Log<'_>) -> Option<()> {
        let frame = self.frame(&place!(ring, "ring"), span, log)?;
        self.disc(&frame, &frame.name, [0.0; 2], &ring.diameter, &ring.inner_diameter, log)?;
        if let Some(read) = &ring.guard {
            let guard = read.get()?;
            let inner = 0.5 * si(&ring.diameter)? + si(&guard.gap)?;
            let name = format!("{}-guard", frame.name);
            self.round(&frame, &name, [0.0; 2], inner + si(&guard.width)?, Some(inner));
            self.guards.push((name, read.span.clone()));
        }
        Some(())
    }

    /// The name, place and attachment of a form.
    fn frame<'a>(&self, place: &Place<'_>, span: &'a Range<usize>, log: &mut Log<'_>) -> Option<Frame<'a>> {
        let name = match place.name {
            Some(read) => read.get()?.0.clone(),
            None => place.default_name.to_owned(),
        };
        let thick = place.thickness.get()?.si;
        let on = match place.on {
            Some(read) => Some((read.get()?, &read.span)),
            None => None,
        };
        let (x2, attached) = match on {
            Some((raw::On::Substrate, _)) => ([-thick, 0.0], None),
            Some((raw::On::LayerTop, span)) => {
                let Some(top) = self.thickness else {
                    log.push(
                        Diagnostic::at(
                            span,
                            format!("\"{}\" lies on top of a layer that is not there", shown(&name)),
                        )
                        .label("there is no [layer]")
                        .help("give its `height` instead, or add a [layer]"),
                    );
                    return None;
                };
                ([top, top + thick], Some(raw::Attached::LayerTop))
            }
            None => {
                let middle = place.height.as_ref()?.get()?.si;
                let mut x2 = [middle - 0.5 * thick, middle + 0.5 * thick];
                // A face may be flush with a face of the layer up to rounding; it is moved there.
                for face in [Some(0.0), self.thickness].into_iter().flatten() {
                    let is_flush = |x: &f64| (x - face).abs() <= 1e-12 * (middle.abs() + thick);
                    x2.iter_mut().filter(|x| is_flush(x)).for_each(|x| *x = face);
                }
                // Bodies inside the layer always move with its material.
                let is_inside = self.thickness.is_some_and(|top| 0.0 <= x2[0] && 0.0 < x2[1] && x2[1] <= top);
                (x2, is_inside.then_some(raw::Attached::Layer))
            }
        };
        let center = match place.center {
            Some(read) => {
                let [x1, x3] = read.get()?;
                [x1.get()?.si, x3.get()?.si]
            }
            None => [0.0; 2],
        };
        Some(Frame { name, span, x2, center, attached })
    }

    /// Adds a conductor of rectangles, which are relative to the middle of the form.
    fn rectangles(&mut self, frame: &Frame<'_>, name: &str, parts: &[Rectangle]) {
        let corner = |x: [f64; 2], x2: f64| {
            let corner = [x[0] + frame.center[0], x2, x[1] + frame.center[1]];
            frame.read(corner.map(|x| frame.read(Position::of(x))))
        };
        let part = |[min, max]: &Rectangle| {
            frame.read(raw::BoxRegion { min: corner(*min, frame.x2[0]), max: corner(*max, frame.x2[1]) })
        };
        let boxes = Some(frame.read(parts.iter().map(part).collect::<Vec<_>>()));
        self.add(frame, name, raw::Conductor { boxes, ..shapeless(frame.span) });
    }

    /// Adds a disc, or a ring, about a point, which is relative to the middle of the form; refuses a hole as
    /// large as the disc.
    fn disc(
        &mut self,
        frame: &Frame<'_>,
        name: &str,
        middle: [f64; 2],
        diameter: &Read<Size>,
        hole: &Option<Read<Size>>,
        log: &mut Log<'_>,
    ) -> Option<()> {
        let outer = si(diameter)?;
        let inner = match hole {
            Some(read) => Some((si(read)?, read)),
            None => None,
        };
        if let Some((_, read)) = inner.filter(|(inner, _)| *inner >= outer) {
            log.push(
                Diagnostic::at(&read.span, "the hole is as large as what it is in")
                    .label("not less than the diameter")
                    .related(&diameter.span, "the diameter")
                    .help("make it smaller, or leave it out for a disc"),
            );
            return None;
        }
        self.round(frame, name, middle, 0.5 * outer, inner.map(|(inner, _)| 0.5 * inner));
        Some(())
    }

    /// Adds a disc, or a ring, of these radii about a point, which is relative to the middle of the form.
    fn round(&mut self, frame: &Frame<'_>, name: &str, middle: [f64; 2], radius: f64, hole: Option<f64>) {
        let base = [middle[0] + frame.center[0], frame.x2[0], middle[1] + frame.center[1]];
        let cylinder = raw::Tube {
            axis: frame.read(raw::Axis::X2),
            base: frame.read(base.map(|x| frame.read(Position::of(x)))),
            radius: frame.read(Size::of(radius)),
            inner_radius: hole.map(|hole| frame.read(Size::of(hole))),
            height: frame.read(Height::of(frame.x2[1] - frame.x2[0])),
        };
        let cylinder = Some(frame.read(cylinder));
        self.add(frame, name, raw::Conductor { cylinder, ..shapeless(frame.span) });
    }

    /// Adds a conductor with this name, which moves with what its form is attached to.
    fn add(&mut self, frame: &Frame<'_>, name: &str, conductor: raw::Conductor) {
        let name = frame.read(Text(name.to_owned()));
        let attached = frame.attached.map(|to| frame.read(to));
        self.conductors.push(frame.read(raw::Conductor { name, attached, ..conductor }));
    }

    /// A rectangular frame around a form that reaches as far as `half` from its middle.
    fn guard(&mut self, frame: &Frame<'_>, guard: &Option<Read<raw::Guard>>, half: [f64; 2]) -> Option<()> {
        let Some(read) = guard else { return Some(()) };
        let guard = read.get()?;
        let (gap, width) = (si(&guard.gap)?, si(&guard.width)?);
        let inner = half.map(|half| half + gap);
        let outer = inner.map(|inner| inner + width);
        let parts = [
            rectangle([-outer[0], -inner[0]], [-outer[1], outer[1]]),
            rectangle([inner[0], outer[0]], [-outer[1], outer[1]]),
            rectangle([-inner[0], inner[0]], [-outer[1], -inner[1]]),
            rectangle([-inner[0], inner[0]], [inner[1], outer[1]]),
        ];
        let name = format!("{}-guard", frame.name);
        self.rectangles(frame, &name, &parts);
        self.guards.push((name, read.span.clone()));
        Some(())
    }
}

/// A conductor without a shape.
fn shapeless(span: &Range<usize>) -> raw::Conductor {
    raw::Conductor {
        name: Read { span: span.clone(), value: None },
        r#box: None,
        boxes: None,
        sheet: None,
        sphere: None,
        capsule: None,
        shell: None,
        cylinder: None,
        extrusion: None,
        surface: None,
        physical: None,
        charge: None,
        attached: None,
    }
}

/// The rectangle with these ranges along x1 and x3.
fn rectangle(x1: [f64; 2], x3: [f64; 2]) -> Rectangle {
    [[x1[0], x3[0]], [x1[1], x3[1]]]
}

/// The value in SI units, if it could be read.
fn si(read: &Read<Size>) -> Option<f64> {
    Some(read.get()?.si)
}

/// The count, if it is from `least` to [`MOST_PARTS`]; `rule` is the message for one below `least`.
fn count(read: &Read<Count>, least: u32, rule: &str, log: &mut Log<'_>) -> Option<u32> {
    let number = read.get()?.0;
    if number < least {
        log.push(
            Diagnostic::at(&read.span, rule)
                .label("too few")
                .help(format!("write for example `{}`", least.max(4))),
        );
        return None;
    }
    if number > MOST_PARTS {
        too_many(&read.span, "parts", log);
        return None;
    }
    Some(number)
}

/// Reports a form of more than [`MOST_PARTS`] parts.
fn too_many(span: &Range<usize>, what: &str, log: &mut Log<'_>) {
    log.push(
        Diagnostic::at(span, format!("more {what} in one form than elastocap takes, which is {MOST_PARTS}"))
            .label("too many")
            .help("compute a part of them: far pads and fingers hardly see one another"),
    );
}
