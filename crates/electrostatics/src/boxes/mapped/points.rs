//! Gauss points on the finite elements of an axis, and the functions of the axis there.

use crate::boxes::domain::Axis;
use elastocap_fem::line::{Element, Numbering, hierarchical};
use elastocap_fem::quadrature::{gauss_legendre, legendre};
use elastocap_fem::radial::RadialBasis;
use faer::Mat;
use std::ops::Range;

/// Gauss points on a run of finite elements.
#[derive(Debug, Clone)]
pub(crate) struct AxisPoints {
    /// Coordinates on the reference element, from -1 to 1.
    reference: Vec<f64>,
    /// Coordinates on the axis, in the unit of the layout.
    pub(crate) places: Vec<f64>,
    /// Weights of integrals along the axis.
    pub(crate) weights: Vec<f64>,
    /// The element of each point, counted from the first finite one.
    pub(crate) element: Vec<usize>,
    /// The interval of each point.
    pub(crate) interval: Vec<usize>,
}

impl AxisPoints {
    /// These points among the elements of another axis, where each element of this axis lies within one
    /// element of the other.
    pub(crate) fn on(&self, axis: &Axis) -> Self {
        let (nodes, first) = (&axis.line.nodes, axis.line.first_finite());
        let last = nodes.len().saturating_sub(2);
        let element: Vec<usize> = self
            .places
            .iter()
            .map(|x| nodes.partition_point(|n| n <= x).saturating_sub(1).min(last))
            .collect();
        let reference = self.places.iter().zip(&element).map(|(x, &e)| {
            let length = nodes[e + 1] - nodes[e];
            2.0 * (x - nodes[e]) / length - 1.0
        });
        let interval =
            element.iter().map(|e| axis.cuts.partition_point(|cut| *cut <= e + first).saturating_sub(1));
        Self {
            reference: reference.collect(),
            interval: interval.collect(),
            places: self.places.clone(),
            weights: self.weights.clone(),
            element,
        }
    }

    /// Points on some elements, `extra` more on each than its degree.
    pub(crate) fn new(axis: &Axis, elements: Range<usize>, extra: usize) -> Self {
        let (mut reference, mut places, mut weights) = (Vec::new(), Vec::new(), Vec::new());
        let (mut element, mut interval) = (Vec::new(), Vec::new());
        for e in elements {
            let Element::Finite { start, length } = axis.line.element(e) else { continue };
            let interval_index = axis.cuts.partition_point(|cut| *cut <= e).saturating_sub(1);
            let (points, w) = gauss_legendre(axis.line.degree(e) + extra);
            for (s, w) in points.into_iter().zip(w) {
                reference.push(s);
                places.push(start + 0.5 * (s + 1.0) * length);
                weights.push(0.5 * length * w);
                element.push(e - axis.line.first_finite());
                interval.push(interval_index);
            }
        }
        Self { reference, places, weights, element, interval }
    }

    /// The points of an axis that begins in the middle of another, together with their mirror images, on that
    /// other axis.
    pub(crate) fn with_mirror_image(&self, upper: &Axis) -> Self {
        let (elements, intervals) = (upper.line.degrees.len(), upper.intervals());
        let mirrored = |below: &dyn Fn(usize) -> f64, above: &[f64]| {
            let images = (0..self.len()).rev().map(below);
            images.chain(above.iter().copied()).collect::<Vec<f64>>()
        };
        let index = |numbers: &[usize], half: usize| {
            let images = numbers.iter().rev().map(|k| half - 1 - k);
            images.chain(numbers.iter().map(|k| half + k)).collect::<Vec<usize>>()
        };
        Self {
            reference: mirrored(&|k| -self.reference[k], &self.reference),
            places: mirrored(&|k| -self.places[k], &self.places),
            weights: mirrored(&|k| self.weights[k], &self.weights),
            element: index(&self.element, elements),
            interval: index(&self.interval, intervals),
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.places.len()
    }

    /// The points of each element in turn.
    pub(crate) fn by_element(&self) -> Vec<Range<usize>> {
        let mut out: Vec<Range<usize>> = Vec::new();
        for (point, element) in self.element.iter().enumerate() {
            match out.last_mut() {
                Some(last) if self.element[last.start] == *element => last.end = point + 1,
                _ => out.push(point..point + 1),
            }
        }
        out
    }

    /// Values and slopes of the functions `window` of an axis (in the trimmed numbering of
    /// [`Axis::functions`]).
    pub(crate) fn functions(&self, axis: &Axis, window: &Range<usize>) -> [Mat<f64>; 2] {
        let first = axis.functions().start;
        self.all_functions(axis, first + window.start..first + window.end)
    }

    /// Values and slopes of functions of an axis, held by walls or not, in the numbering of its line.
    pub(crate) fn all_functions(&self, axis: &Axis, window: Range<usize>) -> [Mat<f64>; 2] {
        let numbering = Numbering::new(&axis.line);
        let finite = axis.line.first_finite();
        let mut out = [Mat::zeros(self.len(), window.len()), Mat::zeros(self.len(), window.len())];
        for (row, (e, &s)) in self.element.iter().map(|e| e + finite).zip(&self.reference).enumerate() {
            let Element::Finite { length, .. } = axis.line.element(e) else { continue };
            let (values, slopes) = hierarchical(axis.line.degree(e), s);
            for (local, index) in numbering.element(&axis.line, e).into_iter().enumerate() {
                let column = index.and_then(|i| i.checked_sub(window.start)).filter(|c| *c < window.len());
                if let Some(column) = column {
                    out[0][(row, column)] = values[local];
                    out[1][(row, column)] = 2.0 / length * slopes[local];
                }
            }
        }
        out
    }

    /// The functions of an axis that are nonzero on the elements of some of the points, in the trimmed
    /// numbering.
    pub(crate) fn functions_on(&self, axis: &Axis, points: &Range<usize>) -> Range<usize> {
        let numbering = Numbering::new(&axis.line);
        let (free, first) = (axis.functions(), axis.line.first_finite());
        let elements = self.element.get(points.clone()).unwrap_or_default();
        let Some((low, high)) = elements.first().zip(elements.last()) else { return 0..0 };
        let elements = low + first..high + first + 1;
        let functions = elements.flat_map(|e| numbering.element(&axis.line, e)).flatten();
        let indices: Vec<usize> = functions.filter(|i| free.contains(i)).map(|i| i - free.start).collect();
        indices.iter().min().zip(indices.iter().max()).map_or(0..0, |(low, high)| *low..high + 1)
    }

    /// The potential modes of an axis without infinite elements that belong to the elements of some of the
    /// points.
    pub(crate) fn modes_on(&self, axis: &Axis, points: &Range<usize>) -> Range<usize> {
        let offsets = elastocap_fem::mixed::potential_offsets(&axis.line);
        let elements = self.element.get(points.clone()).unwrap_or_default();
        let ends = elements.first().zip(elements.last());
        ends.map_or(0..0, |(low, high)| offsets[*low]..offsets[high + 1])
    }

    /// Values of the potential modes of an axis without infinite elements: orthonormal Legendre polynomials,
    /// or the `radial` basis.
    pub(crate) fn modes(&self, axis: &Axis, radial: Option<&RadialBasis>) -> Mat<f64> {
        let offsets = elastocap_fem::mixed::potential_offsets(&axis.line);
        let mut out = Mat::zeros(self.len(), offsets.last().copied().unwrap_or(0));
        for (row, (&e, &s)) in self.element.iter().zip(&self.reference).enumerate() {
            let Element::Finite { length, .. } = axis.line.element(e) else { continue };
            let p = axis.line.degree(e);
            let polynomials = legendre(p - 1, s);
            let scaled = |n: usize| ((2 * n + 1) as f64 / length).sqrt() * polynomials[n];
            for n in 0..p {
                out[(row, offsets[e] + n)] = match radial {
                    None => scaled(n),
                    Some(basis) => (0..p).map(|m| basis.blocks[e][(m, n)] * scaled(m)).sum(),
                };
            }
        }
        out
    }
}
