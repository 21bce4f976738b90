//! The layout of an axis: its range, its ticks and its label.

use super::{Axis, Scale};

/// Text with a raised part, for powers of ten.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Text {
    pub(super) base: String,
    pub(super) raised: String,
    pub(super) rest: String,
}

impl From<String> for Text {
    fn from(base: String) -> Self {
        Self { base, ..Self::default() }
    }
}

/// A labelled position, as a fraction of the axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    pub(super) at: f64,
    pub(super) label: Text,
}

/// The layout of an axis. Positions are fractions of its length, 0 at the start.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout {
    scale: Scale,
    /// The lower end of the axis; its logarithm if the scale is logarithmic.
    from: f64,
    to: f64,
    pub(super) label: Text,
    pub(super) ticks: Vec<Tick>,
    /// The positions of the grid lines between ticks.
    pub(super) minor: Vec<f64>,
}

/// The largest value on an axis; larger ones, whose arithmetic could overflow, are left out.
const LARGEST: f64 = 1e300;
const SMALLEST: f64 = 1e-300;

/// The value, or its logarithm on a logarithmic axis; `None` if the axis cannot show it.
pub(super) fn on_scale(scale: Scale, value: f64) -> Option<f64> {
    match scale {
        _ if !value.is_finite() || value.abs() > LARGEST => None,
        Scale::Linear => Some(value),
        Scale::Logarithmic => (value >= SMALLEST).then(|| value.log10()),
    }
}

impl Layout {
    /// The layout for these values, with about `most` ticks.
    pub(super) fn new(axis: &Axis, values: impl Iterator<Item = f64>, most: usize) -> Self {
        let laid_out = values.filter_map(|v| on_scale(axis.scale, v));
        let range = laid_out.fold(None, |range: Option<(f64, f64)>, v| {
            Some(range.map_or((v, v), |(low, high)| (low.min(v), high.max(v))))
        });
        match axis.scale {
            Scale::Linear => Self::linear(axis, range.unwrap_or((0.0, 1.0)), most),
            Scale::Logarithmic => Self::logarithmic(axis, range.unwrap_or((0.0, 1.0)), most),
        }
    }

    /// The position of a value, as a fraction of the axis; bounds beyond its ends are drawn at the ends.
    pub(super) fn position(&self, value: f64) -> Option<f64> {
        on_scale(self.scale, value).map(|v| self.fraction(v))
    }

    /// The difference between both ends of a linear axis.
    pub(super) fn span(&self) -> f64 {
        self.to - self.from
    }

    /// The layout of a linear axis with exactly these ends and about `most` ticks.
    pub(super) fn between(axis: &Axis, from: f64, to: f64, most: usize) -> Self {
        let (unit, power) = Unit::for_size(axis, from.abs().max(to.abs()));
        let mut layout = Self {
            scale: Scale::Linear,
            from,
            to,
            label: unit.label(axis),
            ticks: Vec::new(),
            minor: Vec::new(),
        };
        for (value, label) in round_values(from, to, power, most) {
            layout.ticks.push(Tick { at: layout.fraction(value), label: label.into() });
        }
        layout
    }

    fn fraction(&self, laid_out: f64) -> f64 {
        ((laid_out - self.from) / (self.to - self.from)).clamp(0.0, 1.0)
    }

    fn linear(axis: &Axis, (low, high): (f64, f64), most: usize) -> Self {
        let largest = low.abs().max(high.abs());
        let (from, to) = if largest < SMALLEST {
            (0.0, 1.0)
        } else if high - low <= 1e-9 * largest {
            (low - 0.1 * largest, high + 0.1 * largest)
        } else {
            let room = 0.05 * (high - low);
            // An axis that comes near zero from one side starts at zero.
            let from = if low >= 0.0 && low < 0.4 * high { 0.0 } else { low - room };
            let to = if high <= 0.0 && high > 0.4 * low { 0.0 } else { high + room };
            (from, to)
        };
        Self::between(axis, from, to, most)
    }

    fn logarithmic(axis: &Axis, (low, high): (f64, f64), most: usize) -> Self {
        let room = if high - low < 1e-9 { 0.3 } else { 0.04 * (high - low) };
        let mut layout = Self {
            scale: Scale::Logarithmic,
            from: low - room,
            to: high + room,
            label: axis.label.clone().into(),
            ticks: Vec::new(),
            minor: Vec::new(),
        };
        let (first, last) = (layout.from.ceil() as i32, layout.to.floor() as i32);
        let inside = |at: f64| at >= layout.from && at <= layout.to;
        let digits_and_powers = |digits: &[i32]| -> Vec<(i32, i32)> {
            let candidates =
                (first - 1..=last).flat_map(|power| digits.iter().map(move |&digit| (digit, power)));
            candidates.filter(|&(digit, power)| inside(log10(digit, power))).collect()
        };
        let decades = usize::try_from(last - first + 1).unwrap_or(0);
        let one_two_five = digits_and_powers(&[1, 2, 5]);
        let (ticks, minor) = if decades < 3 && (one_two_five.len() <= most || decades < 2) {
            (one_two_five, digits_and_powers(&[3, 4, 6, 7, 8, 9]))
        } else {
            let stride = decades.div_ceil(most.max(2)) as i32;
            let ticks = (first..=last).filter(|power| power.rem_euclid(stride) == 0).map(|power| (1, power));
            let between: &[i32] = if stride == 1 { &[2, 3, 4, 5, 6, 7, 8, 9] } else { &[1] };
            (ticks.collect(), digits_and_powers(between))
        };
        if ticks.len() > 2 || decades >= 2 {
            let plain = ticks.iter().all(|&(_, power)| (-3..=4).contains(&power));
            layout.minor =
                minor.into_iter().map(|(digit, power)| layout.fraction(log10(digit, power))).collect();
            for (digit, power) in ticks {
                let at = layout.fraction(log10(digit, power));
                layout.ticks.push(Tick { at, label: logarithmic_label(axis, digit, power, plain) });
            }
        } else {
            // In so short a range there are few or none of those values, so round values are used as on a
            // linear axis.
            let (from, to) = (10_f64.powf(layout.from), 10_f64.powf(layout.to));
            let (unit, power) = Unit::for_size(axis, to);
            layout.label = unit.label(axis);
            for (value, label) in round_values(from, to, power, most) {
                layout.ticks.push(Tick { at: layout.fraction(value.log10()), label: label.into() });
            }
            return layout;
        }
        if !axis.unit.is_empty() && !takes_prefix(&axis.unit) {
            layout.label = format!("{} ({})", axis.label, axis.unit).into();
        }
        layout
    }
}

fn log10(digit: i32, power: i32) -> f64 {
    f64::from(digit).log10() + f64::from(power)
}

/// Round values between the ends, at most about `most`, with their text in units of a power of ten.
pub(super) fn round_values(from: f64, to: f64, power: i32, most: usize) -> Vec<(f64, String)> {
    let unit = 10_f64.powi(power);
    let (from, to) = (from / unit, to / unit);
    let raw = (to - from) / most.max(1) as f64;
    let decade = raw.log10().floor();
    let of_decade = 10_f64.powf(decade);
    let steps = [1.0, 2.0, 2.5, 5.0, 10.0];
    let digit = steps.into_iter().find(|s| s * of_decade >= raw * (1.0 - 1e-9)).unwrap_or(10.0);
    let step = digit * of_decade;
    let places = (-decade as i32 + i32::from(digit == 2.5) - i32::from(digit == 10.0)).clamp(0, 20) as usize;
    let slack = 1e-9 * (to - from);
    let (first, last) = (((from - slack) / step).ceil(), ((to + slack) / step).floor());
    // Far from zero the step may vanish in rounding; the count is limited whatever the rounding.
    let count = (last - first).clamp(0.0, 2.0 * most as f64) as usize;
    let values = (0..=count).map(|i| (first + i as f64) * step);
    values.map(|value| (value * unit, number(value, places))).collect()
}

/// The number with a true minus sign, and without a minus sign before zero.
fn number(value: f64, places: usize) -> String {
    let text = format!("{:.places$}", value.abs());
    let negative = value < 0.0 && text.bytes().any(|b| (b'1'..=b'9').contains(&b));
    if negative { format!("\u{2212}{text}") } else { text }
}

fn logarithmic_label(axis: &Axis, digit: i32, power: i32, plain: bool) -> Text {
    if takes_prefix(&axis.unit)
        && let Some(prefix) = prefix(power.div_euclid(3) * 3)
    {
        let value = digit * 10_i32.pow(power.rem_euclid(3) as u32);
        return format!("{value} {prefix}{}", axis.unit).into();
    }
    if plain {
        return number(f64::from(digit) * 10_f64.powi(power), usize::try_from(-power).unwrap_or(0)).into();
    }
    let base = if digit == 1 { "10".to_owned() } else { format!("{digit}\u{b7}10") };
    Text { base, raised: signed(power), rest: String::new() }
}

fn signed(power: i32) -> String {
    if power < 0 { format!("\u{2212}{}", -power) } else { power.to_string() }
}

/// The unit of an axis: the given one with a prefix, or with a power of ten.
struct Unit {
    prefix: &'static str,
    /// The power of ten that is written out where no prefix stands for it.
    power: i32,
}

impl Unit {
    /// The unit for numbers of this size, and the power of ten that the numbers of the axis are divided by.
    fn for_size(axis: &Axis, largest: f64) -> (Self, i32) {
        let power = (largest.log10() + 1e-9).div_euclid(3.0) as i32 * 3;
        if takes_prefix(&axis.unit)
            && let Some(prefix) = prefix(power)
        {
            return (Self { prefix, power: 0 }, power);
        }
        let readable = (1e-2..1e5).contains(&largest);
        let power = if readable { 0 } else { power };
        (Self { prefix: "", power }, power)
    }

    fn label(&self, axis: &Axis) -> Text {
        let unit = format!("{}{}", self.prefix, axis.unit);
        match (self.power, unit.is_empty()) {
            (0, true) => axis.label.clone().into(),
            (0, false) => format!("{} ({unit})", axis.label).into(),
            (power, no_unit) => Text {
                base: format!("{} (\u{d7}10", axis.label),
                raised: signed(power),
                rest: if no_unit { ")".into() } else { format!(" {unit})") },
            },
        }
    }
}

/// Whether an SI prefix may stand before the unit: not before %, h or anything unknown.
fn takes_prefix(unit: &str) -> bool {
    ["m", "s", "N", "Pa", "V", "F", "C", "J", "W", "A", "Hz", "g", "B", "V/m", "N/m"].contains(&unit)
}

fn prefix(power: i32) -> Option<&'static str> {
    let prefixes = ["y", "z", "a", "f", "p", "n", "\u{b5}", "m", "", "k", "M", "G", "T", "P", "E"];
    usize::try_from(power.div_euclid(3) + 8).ok().and_then(|i| prefixes.get(i).copied())
}
