//! The lengths in a finite-element layer on which capacitances depend: the gap of a pair, its facing area
//! over the gap, and the distances of other bodies.

use elastocap_mechanics::solid::dimension::{Dimension, Numbers};
use elastocap_mechanics::solid::layer::{Inclusion, LayerModel};
use elastocap_mechanics::solid::model::{Body, State};
use elastocap_mechanics::solid::press::Mean;
use elastocap_mechanics::solid::probe::Probe;

use super::electrode_box::{ElectrodeBox, Ends, Face};
use super::material::{Folded, Material};
use super::rods::Rods;
use elastocap_case::{Case, Layout};

/// The smallest relative tolerance of distances: they hardly change at small loads. It is not tuned.
const LEAST_TOLERANCE: f64 = 1e-4;

/// The bodies in the layer of a case, in its solved part.
pub(super) struct LayerPlaces<'a, S: Dimension> {
    case: &'a Case,
    thickness: f64,
    inclusions: &'a [Inclusion<S>],
    layout: Option<Layout>,
    /// Width of the electrodes along x3 in plane strain, m.
    width: f64,
    rods: Rods,
    /// The ends of the rods in the solved part.
    folded: Vec<Folded>,
    /// The [numbers](Self::numbers) before loading.
    at_rest: Vec<f64>,
}

impl<'a, S: Dimension> LayerPlaces<'a, S> {
    /// The bodies of a case. `inclusions` are its electrodes in the solved part of the layer; `is_half` says
    /// whether that is only the half at positive x1.
    pub(super) fn new(case: &'a Case, thickness: f64, inclusions: &'a [Inclusion<S>], is_half: bool) -> Self {
        let rods = Rods::of(case);
        let nowhere = |_: [f64; 3]| None;
        let folded = match Material::of(case, is_half, &nowhere) {
            Some(material) => rods.ends().into_iter().map(|x| material.fold(x)).collect(),
            None => Vec::new(),
        };
        let layout = case.electrodes.as_ref().map(|e| e.layout);
        let width = case.electrodes.as_ref().map_or(0.0, |e| e.width);
        let mut places =
            Self { case, thickness, inclusions, layout, width, rods, folded, at_rest: Vec::new() };
        let means = 2 * S::AXES * inclusions.len() + S::AXES * places.folded.len();
        places.at_rest = places.numbers(&vec![0.0; means]);
        places
    }

    /// The means of displacements on which the [numbers](Self::numbers) depend: of the lower and the upper
    /// face of each electrode along each axis, and of the ends of the rods.
    pub(super) fn means(&self, model: &LayerModel<S>) -> Vec<Mean> {
        let body = model.equations().body();
        let faces = (0..self.inclusions.len()).flat_map(|k| (0..S::AXES).map(move |axis| (k, axis)));
        let mut means: Vec<Mean> = faces.flat_map(|(k, axis)| self.face_means(body, k, axis)).collect();
        if self.folded.is_empty() {
            return means;
        }
        let probe = Probe::new(model.equations(), model.state());
        for end in &self.folded {
            let at = |place: &[f64; 3]| probe.weights(S::Point::from_fn(|k| place[k]));
            let found = end.places.iter().find_map(at).unwrap_or_default();
            let along = |axis: usize| -> Mean {
                found
                    .iter()
                    .map(|&(node, weight)| (S::AXES * node + axis, end.signs[axis] * weight))
                    .collect()
            };
            means.extend((0..S::AXES).map(along));
        }
        means
    }

    /// The numbers on which capacitances depend, from these means in m: the gap of a pair and its area over
    /// the gap, in m, and the mean stretches of the rods.
    pub(super) fn numbers(&self, means: &[f64]) -> Vec<f64> {
        let (of_faces, of_ends) = means.split_at(2 * S::AXES * self.inclusions.len());
        let end = |u: &[f64]| [u[0], u[1], u.get(2).copied().unwrap_or(0.0)];
        let ends: Vec<[f64; 3]> = of_ends.chunks_exact(S::AXES).map(end).collect();
        let mut numbers = self.facing(&self.moved(of_faces));
        numbers.extend(self.rods.mean_stretches(&ends));
        numbers
    }

    /// The relative tolerance of each number.
    pub(super) fn tolerances(&self, numbers: &[f64]) -> Vec<f64> {
        let field = self.case.electrostatics.as_ref();
        let tolerance = |(number, rest): (&f64, &f64)| {
            let of_value = field.map_or(f64::INFINITY, |field| field.relative_tolerance);
            let of_change = field.and_then(|field| field.change_tolerance).unwrap_or(f64::INFINITY);
            // The capacitance changes roughly in proportion to the distances.
            of_value.min(of_change * (number / rest - 1.0).abs()).max(LEAST_TOLERANCE)
        };
        numbers.iter().zip(&self.at_rest).map(tolerance).collect()
    }

    /// The gap of a pair in m, and the area over the gap, in m, that its parallel-plate capacitance is
    /// proportional to; nothing without a pair.
    fn facing(&self, electrodes: &[Ends]) -> Vec<f64> {
        let extent = |e: &Ends, axis: usize| e[axis][1] - e[axis][0];
        let (axis, gap, [one, other]) = match (self.layout, electrodes) {
            (Some(Layout::InPlane), [right]) => (0, 2.0 * right[0][0], [right; 2]),
            (Some(Layout::InPlane), [left, right]) => (0, right[0][0] - left[0][1], [left, right]),
            (Some(Layout::Stacked), [lower, upper]) => (1, upper[1][0] - lower[1][1], [lower, upper]),
            _ => return Vec::new(),
        };
        let across = (0..3).filter(|a| *a != axis);
        let area: f64 = across.map(|a| extent(one, a).min(extent(other, a))).product();
        vec![gap, area / gap]
    }

    /// The ends of the electrodes if the mean displacements of their faces are these, for each electrode and
    /// axis at the lower and the upper end. In three dimensions only the half with positive x3 is solved,
    /// whose lower end is the image of the upper one.
    fn moved(&self, means: &[f64]) -> Vec<Ends> {
        let moved_ends = |(inclusion, means): (&Inclusion<S>, &[f64])| {
            let mut ends = [[-0.5 * self.width, 0.5 * self.width]; 3];
            for (a, ends) in ends.iter_mut().enumerate().take(S::AXES) {
                *ends = [inclusion.min[a] + means[2 * a], inclusion.max[a] + means[2 * a + 1]];
            }
            ends[2][0] = -ends[2][1];
            ends
        };
        self.inclusions.iter().zip(means.chunks_exact(2 * S::AXES)).map(moved_ends).collect()
    }

    /// The mean displacements along `axis` of the lower and the upper face of an electrode there.
    fn face_means(&self, body: &Body<S>, electrode: usize, axis: usize) -> [Mean; 2] {
        let along = |(node, weight): (usize, f64)| (S::AXES * node + axis, weight);
        self.faces(body, electrode, axis).map(|face| face.into_iter().map(along).collect())
    }

    /// The nodes of the lower and the upper face of an electrode across `axis`, with the share of the
    /// undeformed face that belongs to each. Nodes of several elements are repeated.
    fn faces(&self, body: &Body<S>, electrode: usize, axis: usize) -> [Vec<(usize, f64)>; 2] {
        let (inclusion, tiny) = (&self.inclusions[electrode], 1e-9 * self.thickness);
        let of_electrode = |material: u16| usize::from(material) == electrode + 1;
        let mesh = &body.mesh;
        let solid = mesh.elements.iter().zip(&body.material).filter(|(_, material)| of_electrode(**material));
        let elements: Vec<&[u32]> = solid.map(|(element, _)| element.as_ref()).collect();
        [inclusion.min[axis], inclusion.max[axis]].map(|at| {
            let mut nodes = Vec::new();
            let sides = elements.iter().flat_map(|e| S::SIDES.iter().map(move |side| (*e, *side)));
            for (element, side) in sides {
                let place = |k: usize| &mesh.nodes[element[side[k]] as usize];
                let last = side.len() - 1;
                if (0..=last).any(|k| (place(k)[axis] - at).abs() > tiny) {
                    continue;
                }
                let size = |a: usize| (place(last)[a] - place(0)[a]).abs();
                let area: f64 = (0..S::AXES).filter(|a| *a != axis).map(size).product();
                // Integrals of the shape functions over the side.
                let part = |k: usize| match last {
                    2 => THREE[k],
                    _ => THREE[k % 3] * THREE[k / 3],
                };
                nodes.extend((0..=last).map(|k| (element[side[k]] as usize, area * part(k))));
            }
            let area: f64 = nodes.iter().map(|(_, weight)| weight).sum();
            nodes.into_iter().map(|(node, weight)| (node, weight / area)).collect()
        })
    }

    /// The electrodes as boxes.
    pub(super) fn boxes(&self, body: &Body<S>, state: &State<S>) -> Vec<ElectrodeBox> {
        let electrode_box = |electrode: usize| {
            let face = |nodes: Vec<(usize, f64)>| -> Face {
                let place = |(node, weight): (usize, f64)| {
                    let u = &state.displacement[S::AXES * node..];
                    let mut x = S::in_space(&body.mesh.nodes[node]);
                    for (x, u) in x.iter_mut().zip(&u[..S::AXES]) {
                        *x += u;
                    }
                    (weight, x)
                };
                nodes.into_iter().map(place).collect()
            };
            let mut faces = [0, 1, 2].map(|axis| match axis < S::AXES {
                true => self.faces(body, electrode, axis).map(face),
                false => [Face::new(), Face::new()],
            });
            if S::AXES == 3 {
                return ElectrodeBox::new(&faces).with_mirror_image();
            }
            // The displacement along x3 is zero.
            faces[2] = [-0.5, 0.5].map(|side| {
                faces[1][0].iter().map(|&(weight, [x, y, _])| (weight, [x, y, side * self.width])).collect()
            });
            ElectrodeBox::new(&faces)
        };
        (0..self.inclusions.len()).map(electrode_box).collect()
    }
}

/// Integrals of the shape functions of the three nodes of a line, over its length.
const THREE: [f64; 3] = [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0];
