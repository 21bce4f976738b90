//! A posteriori estimates of the errors of an equilibrium, and the share of each element in them.
//!
//! The stress of a finite-element solution jumps from element to element. Averaged at the nodes of each
//! material it is closer to the true stress, and the difference between the two indicates the error of the
//! stress (O. C. Zienkiewicz and J. Z. Zhu, Int. J. Numer. Methods Eng. 24, 1987). The energy of that
//! difference gives the error of the force, whose slope along the load is an energy.
//!
//! The energy says little about the error of any other number that is computed from an equilibrium. For such
//! a number the *response* is computed: the displacements under forces equal to the derivatives of the number
//! by the displacements. The error of the number is the energy product of the errors of the stress and of the
//! response's stress (the dual-weighted residual: R. Becker and R. Rannacher, Acta Numerica 10, 2001; with
//! recovered stresses: F. Cirak and E. Ramm, Comput. Methods Appl. Mech. Eng. 156, 1998). The response costs
//! one solve with the existing factors.
//!
//! An element is cut along those of its axes along which the averaged stress is farthest from linear.

use std::collections::HashMap;

use rayon::prelude::*;

use super::dimension::{Dimension, Element, Numbers, Stress};
use super::model::{Equations, State};
use super::shape_functions::{linear_fit_weights, shape};

/// An element is cut along the axes where the curvature of the stress is at least this share of the largest
/// curvature over its axes. Tuned: `benches/layer_errors.py`.
const ALONG: f64 = 0.35;
/// The assumed ratio of the relative error of a force to the energy of the stress error over the work of the
/// force. For a smooth solution it is 1; around electrodes and rounded punches it was 0.7 to 4, under
/// cylinders and balls, where the edge of the contact adds errors, 2 to 4. Tuned: `benches/layer_errors.py`.
const OF_FORCE: f64 = 4.0;
/// The assumed ratio of the error of a number to its estimate. Tuned: `benches/layer_errors.py`.
const OF_NUMBER: f64 = 1.5;
/// The share of the sum of magnitudes over the elements that is added to the sum with signs, whose terms may
/// cancel wrongly on coarse meshes. Tuned: `benches/layer_errors.py`.
const WITHOUT_SIGNS: f64 = 0.5;
/// The ratio of the increase of the shear modulus of stretched rubber to the norm of its deviatoric stress,
/// as for a neo-Hookean rubber under a large simple stretch.
const STIFFER: f64 = 0.4;
/// The largest displacement, over the shortest side of the box around the body, by which the stress of a
/// response is computed from a difference. Not tuned: it only has to lie above rounding errors and below
/// strains that matter.
const SMALL: f64 = 1e-6;
/// The residual of a linear solve for a response above which the factors count as those of another tangent.
/// It is not tuned.
const STALE: f64 = 1e-6;

/// The numbers to be computed from an equilibrium, and their tolerances.
#[derive(Debug)]
pub(crate) struct Wanted {
    /// Force times displacement of the indenter, for the part of the layer that is modelled, in J; in the
    /// plane in J/m.
    pub(crate) work: f64,
    /// A safety factor on all estimates.
    pub(crate) caution: f64,
    /// The relative error of the force to reach.
    pub(crate) force_tolerance: f64,
    /// The other numbers.
    pub(crate) numbers: Vec<WantedNumber>,
}

/// A number to be computed from an equilibrium.
#[derive(Debug)]
pub(crate) struct WantedNumber {
    /// The value.
    pub(crate) value: f64,
    /// The derivatives by the displacements, each with the index of its displacement among those of all
    /// nodes.
    pub(crate) slopes: Vec<(usize, f64)>,
    /// The relative error to reach.
    pub(crate) tolerance: f64,
}

/// The estimated error of an equilibrium.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Estimate {
    /// Error of the force over the force.
    pub(crate) force: f64,
    /// The other numbers.
    pub(crate) numbers: Vec<Estimated>,
    /// The share of each element in the errors.
    pub(crate) elements: Vec<Share>,
}

/// A number and its estimated error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Estimated {
    /// The number.
    pub(crate) value: f64,
    /// The error over the number.
    pub(crate) error: f64,
    /// The relative error to reach.
    pub(crate) tolerance: f64,
}

/// The share of an element in the errors of an equilibrium.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Share {
    /// The share in the sum of all errors over their tolerances.
    pub(crate) error: f64,
    /// The axes along which cutting the element reduces this share, as bits.
    pub(crate) axes: u8,
}

/// A field of stresses, and the smooth field recovered from it.
struct Recovered<S: Dimension> {
    /// For each element the stress of the finite elements at its quadrature points.
    points: Vec<Vec<Stress>>,
    /// For each element the smooth stress at its nodes.
    nodes: Vec<Vec<Stress>>,
    /// For each element the deviator of the difference of the two at its quadrature points.
    differences: Vec<Vec<Stress>>,
    dimension: std::marker::PhantomData<S>,
}

impl<S: Dimension> Recovered<S> {
    /// Recovers the smooth field from `stress`, which takes the number of an element and that of one of its
    /// quadrature points.
    fn new(equations: &Equations<S>, stress: impl Fn(usize, usize) -> Stress + Sync) -> Self {
        let mesh = &equations.body.mesh;
        let of_element = |e: usize| (0..S::Element::POINTS).map(|q| stress(e, q)).collect();
        let elements = (0..mesh.elements.len()).into_par_iter().with_min_len(16);
        let points: Vec<Vec<Stress>> = elements.map(of_element).collect();
        let of_element =
            |points: &Vec<Stress>| (0..S::Element::NODES).map(|n| extrapolated::<S>(points, n)).collect();
        let mut nodes: Vec<Vec<Stress>> = points.par_iter().with_min_len(16).map(of_element).collect();
        let mut sums: HashMap<(u16, u32), (f64, Stress)> = HashMap::new();
        let key = |e: usize, node: u32| (equations.body.material[e], node);
        for (e, stresses) in nodes.iter().enumerate() {
            let weight = equations.elements[e].volume();
            for (stress, &node) in stresses.iter().zip(mesh.elements[e].as_ref()) {
                let sum = sums.entry(key(e, node)).or_default();
                sum.0 += weight;
                for (sum, component) in sum.1.iter_mut().zip(stress) {
                    *sum += weight * component;
                }
            }
        }
        for (e, stresses) in nodes.iter_mut().enumerate() {
            for (stress, &node) in stresses.iter_mut().zip(mesh.elements[e].as_ref()) {
                let (weight, sum) = sums[&key(e, node)];
                *stress = sum.map(|s| s / weight);
            }
        }
        let shapes = gauss_shapes::<S>();
        let of_element = |(points, nodes): (&Vec<Stress>, &Vec<Stress>)| {
            let points = points.iter().zip(&shapes);
            points.map(|(stress, shape)| deviator(difference(stress, nodes, shape))).collect()
        };
        let differences = points.par_iter().zip(&nodes).with_min_len(16).map(of_element).collect();
        Self { points, nodes, differences, dimension: std::marker::PhantomData }
    }

    /// For each quadrature point of element `e` its volume over twice the modulus of small shears. In rubber
    /// that is stretched `l`-fold, the modulus grows about in proportion to the stress, since both grow with
    /// `l^2`.
    fn compliances(&self, equations: &Equations<S>, e: usize) -> Vec<f64> {
        let (element, modulus) = (&equations.elements[e], equations.rubber(e).shear_modulus());
        let compliance = |(q, stress): (usize, &Stress)| {
            let stress = deviator(*stress);
            let stretched = STIFFER * double_dot(&stress, &stress).sqrt();
            element.point_volume(q) / (2.0 * (modulus + stretched))
        };
        self.points[e].iter().enumerate().map(compliance).collect()
    }

    /// The energy product of the differences of two fields in element `e`.
    fn product(&self, other: &Self, compliances: &[f64], e: usize) -> f64 {
        let pairs = self.differences[e].iter().zip(&other.differences[e]);
        pairs.zip(compliances).map(|((a, b), compliance)| compliance * double_dot(a, b)).sum()
    }

    /// The deviation of the stress in element `e` from a linear one along each of its axes, over the largest
    /// of these.
    fn curvatures(&self, e: usize) -> Vec<f64> {
        let curvatures: Vec<f64> = (0..S::AXES).map(|axis| curvature(&self.nodes[e], axis)).collect();
        let largest = curvatures.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        curvatures.into_iter().map(|curvature| curvature / largest).collect()
    }
}

impl<S: Dimension> Equations<S> {
    /// Estimates the errors of the `wanted` numbers of `state`, an equilibrium. The last assembly must have
    /// been at this state.
    pub(crate) fn estimate(&mut self, state: &State<S>, wanted: &Wanted) -> Estimate {
        let responses: Vec<_> = wanted.numbers.iter().map(|number| self.response(&number.slopes)).collect();
        let this = &*self;
        let stress = |e: usize, q: usize, u: &[f64], p: &S::Pressure| {
            let (element, u) = (&this.elements[e], this.gather(e, u));
            let ratio = element.volume_ratio(q, &u);
            element.stress(this.rubber(e), q, &u, p).map(|s| ratio * s)
        };
        let solution = Recovered::new(this, |e, q| stress(e, q, &state.displacement, &state.pressure[e]));
        let of_response = |(z, pressure): &(Vec<f64>, Vec<S::Pressure>)| {
            let largest = z.iter().fold(f64::MIN_POSITIVE, |m: f64, z| m.max(z.abs()));
            let part = SMALL * this.shortest_side / largest;
            let moved: Vec<f64> = state.displacement.iter().zip(z).map(|(u, z)| u + part * z).collect();
            Recovered::new(this, |e, q| {
                let p = S::Pressure::from_fn(|m| state.pressure[e][m] + part * pressure[e][m]);
                let (before, after) = (&solution.points[e][q], stress(e, q, &moved, &p));
                std::array::from_fn(|k| (after[k] - before[k]) / part)
            })
        };
        let responses: Vec<Recovered<S>> = responses.iter().map(of_response).collect();
        // For each element the energy of the error, and for each number the product with the response and its
        // upper bound.
        let of_element = |e: usize| -> (f64, Vec<[f64; 2]>) {
            let compliances = solution.compliances(this, e);
            let energy = solution.product(&solution, &compliances, e);
            let product = |response: &Recovered<S>| {
                let bound = (energy * response.product(response, &compliances, e)).sqrt();
                [solution.product(response, &compliances, e), bound]
            };
            (energy, responses.iter().map(product).collect())
        };
        let elements = (0..this.elements.len()).into_par_iter().with_min_len(16);
        let parts: Vec<(f64, Vec<[f64; 2]>)> = elements.map(of_element).collect();
        let caution = wanted.caution;
        let sum = |k: usize, term: usize| parts.iter().map(|part| part.1[k][term]).sum::<f64>();
        let estimated = |(k, number): (usize, &WantedNumber)| {
            let error =
                caution * OF_NUMBER * (sum(k, 0).abs() + WITHOUT_SIGNS * sum(k, 1)) / number.value.abs();
            Estimated { value: number.value, error, tolerance: number.tolerance }
        };
        let share = |(e, (energy, products)): (usize, &(f64, Vec<[f64; 2]>))| {
            let of_force = energy / (wanted.work * wanted.force_tolerance);
            let of_number = |(product, number): (&[f64; 2], &WantedNumber)| {
                product[1] / (number.tolerance * number.value.abs())
            };
            let of_numbers: Vec<f64> = products.iter().zip(&wanted.numbers).map(of_number).collect();
            let worst_number = (0..of_numbers.len()).max_by(|&a, &b| of_numbers[a].total_cmp(&of_numbers[b]));
            let mut curved = solution.curvatures(e);
            if let Some(k) = worst_number.filter(|&k| of_numbers[k] > of_force) {
                curved.iter_mut().zip(responses[k].curvatures(e)).for_each(|(sum, more)| *sum += more);
            }
            let largest = curved.iter().copied().fold(0.0, f64::max);
            let axes = (0..S::AXES).filter(|&a| curved[a] >= ALONG * largest).map(|a| 1 << a).sum();
            Share { error: of_force + of_numbers.iter().sum::<f64>(), axes }
        };
        Estimate {
            force: caution * OF_FORCE * parts.iter().map(|part| part.0).sum::<f64>() / wanted.work,
            numbers: wanted.numbers.iter().enumerate().map(estimated).collect(),
            elements: parts.par_iter().enumerate().with_min_len(16).map(share).collect(),
        }
    }

    /// The displacements, and the pressures in the elements, under the forces `slopes`, by the tangent of the
    /// last assembly.
    fn response(&mut self, slopes: &[(usize, f64)]) -> (Vec<f64>, Vec<S::Pressure>) {
        let mut right = vec![0.0; self.unknowns()];
        for &(d, slope) in slopes {
            let (node, axis) = ((d / S::AXES) as u32, d % S::AXES);
            let free = [(node, 1.0)];
            let masters = self.body.mesh.hanging.nodes.get(&node).map_or(&free[..], Vec::as_slice);
            for &(master, part) in masters {
                if let Some(number) = self.unknowns.index(S::AXES * master as usize + axis) {
                    right[number] += part * slope;
                }
            }
        }
        let mut x = right.clone();
        if self.solver.solve(&mut x) > STALE && self.factorise().is_some() {
            x = right;
            self.solver.solve(&mut x);
        }
        let value = |d: usize| self.unknowns.index(d).map_or(0.0, |number| x[number]);
        let mut displacement: Vec<f64> = (0..self.unbalanced.len()).map(value).collect();
        self.let_follow(&mut displacement);
        let pressure = (0..self.elements.len()).map(|e| self.pressure_response(e, &displacement)).collect();
        (displacement, pressure)
    }
}

/// For each element the axes along which to cut it, as bits. The elements with the largest shares in the
/// errors are cut, so that the mesh gets about `growth` times as many elements. `cut_along(element, axes)`
/// returns the axes along which an element is cut that is marked along `axes`. The `estimates` are those of
/// the equilibria under several loads on one mesh; the result is `None` if there are none.
pub(crate) fn marks(
    estimates: &[&Estimate],
    growth: f64,
    cut_along: impl Fn(usize, u8) -> u8,
) -> Option<Vec<u8>> {
    let count = estimates.first()?.elements.len();
    let sum_of_shares = |e: usize| {
        let largest = estimates.iter().map(|estimate| estimate.elements[e].error).fold(0.0, f64::max);
        let mut total = Share::default();
        for share in estimates.iter().map(|estimate| &estimate.elements[e]) {
            total.error += share.error;
            total.axes |= if share.error >= 0.5 * largest { share.axes } else { 0 };
        }
        total
    };
    let shares: Vec<Share> = (0..count).map(sum_of_shares).collect();
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| shares[b].error.total_cmp(&shares[a].error));
    let mut marks = vec![0_u8; count];
    let mut added = 0.0;
    for e in order {
        if added >= (growth - 1.0) * count as f64 {
            break;
        }
        marks[e] = cut_along(e, shares[e].axes);
        added += f64::from(1_u32 << u8::count_ones(marks[e])) - 1.0;
    }
    Some(marks)
}

/// The `stress` at a point minus the stress interpolated there from the `nodes`, by the values of their shape
/// functions.
fn difference(stress: &Stress, nodes: &[Stress], shape: &[f64]) -> Stress {
    let mut difference = *stress;
    for (value, shape) in nodes.iter().zip(shape) {
        for (d, v) in difference.iter_mut().zip(value) {
            *d -= shape * v;
        }
    }
    difference
}

/// A stress without its mean normal stress, which does no work in a rubber of constant volume.
fn deviator(mut stress: Stress) -> Stress {
    let mean = (stress[0] + stress[1] + stress[2]) / 3.0;
    stress[..3].iter_mut().for_each(|s| *s -= mean);
    stress
}

/// The sum of the products of all nine components of two stresses.
fn double_dot(a: &Stress, b: &Stress) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum::<f64>() + 2.0 * (3..6).map(|k| a[k] * b[k]).sum::<f64>()
}

/// The stress at node `n` of an element from that at its quadrature points, by a fit that is linear along
/// each axis.
fn extrapolated<S: Dimension>(points: &[Stress], n: usize) -> Stress {
    let lines = [n % 3, n / 3 % 3, n / 9].map(linear_fit_weights);
    let mut sum = [0.0; 6];
    for (q, stress) in points.iter().enumerate() {
        let weight: f64 =
            [q % 3, q / 3 % 3, q / 9].iter().zip(&lines).take(S::AXES).map(|(k, l)| l[*k]).product();
        for (sum, component) in sum.iter_mut().zip(stress) {
            *sum += weight * component;
        }
    }
    sum
}

/// The shape functions of all nodes at each quadrature point.
fn gauss_shapes<S: Dimension>() -> Vec<Vec<f64>> {
    let (points, _) = elastocap_fem::quadrature::gauss_legendre(3);
    let shapes = |q: usize| shape::<S>([points[q % 3], points[q / 3 % 3], points[q / 9]]);
    (0..S::Element::POINTS).map(|q| shapes(q).iter().take(S::Element::NODES).map(|s| s.0).collect()).collect()
}

/// The deviation of the stress at the nodes of an element from a linear one along one of its axes: the root
/// of the sum of squares.
fn curvature(nodal: &[Stress], axis: usize) -> f64 {
    let stride = 3_usize.pow(axis as u32);
    let lines = (0..nodal.len()).filter(|n| (n / stride).is_multiple_of(3));
    let bent = lines.map(|n| {
        let [a, b, c] = [0, 1, 2].map(|k| &nodal[n + k * stride]);
        let bend: Stress = std::array::from_fn(|k| a[k] - 2.0 * b[k] + c[k]);
        double_dot(&bend, &bend)
    });
    bent.sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::dimension::{Plane, Space};
    use crate::solid::layer::{End, Indenter, LayerMesh, LayerModel, LayerStep};
    use crate::solid::newton::NewtonSettings;
    use crate::solid::obstacle::IndenterProfile;
    use crate::solid::probe::Probe;
    use crate::solid::space::layer::{SideCondition, SpaceLayerMesh};
    use elastocap_materials::Rubber;

    const BALL: Indenter = Indenter::Smooth(IndenterProfile::Sphere { radius: 1.5 });

    fn section(n: usize) -> LayerMesh {
        LayerMesh::uniform(1.0, 3.0, n, 0.5, n / 2)
    }

    fn in_plane(n: usize) -> LayerModel<Plane> {
        let cylinder = Indenter::Smooth(IndenterProfile::Cylinder { radius: 1.5 });
        LayerModel::new(&section(n), Rubber::neo_hookean(1.0), cylinder, End::FreeOnSubstrate).unwrap()
    }

    fn in_space(n: usize) -> LayerModel<Space> {
        let mesh = SpaceLayerMesh::new(section(n), 1.5, n);
        LayerModel::of_finite_width(&mesh, Rubber::neo_hookean(1.0), BALL, End::Free, SideCondition::Free)
            .unwrap()
    }

    /// The displacement at a point along an axis as a wanted number.
    fn at_point<S: Dimension>(model: &LayerModel<S>, x: S::Point, axis: usize) -> WantedNumber {
        let probe = Probe::new(model.equations(), model.state());
        let value = probe.displacement(x).unwrap()[axis];
        let slopes =
            probe.weights(x).unwrap().into_iter().map(|(node, weight)| (S::AXES * node + axis, weight));
        WantedNumber { value, slopes: slopes.collect(), tolerance: 1e-2 }
    }

    /// Checks that the errors estimated on a coarse mesh cover the differences from a fine one, and are not
    /// far above them.
    fn covers<S: Dimension>(mut coarse: LayerModel<S>, mut fine: LayerModel<S>, x: S::Point) {
        let settings = NewtonSettings::default();
        let [step, fine_step] = [&mut coarse, &mut fine].map(|model| model.press(0.1, &settings).unwrap());
        let numbers = vec![at_point(&coarse, x, 0), at_point(&coarse, x, 1)];
        let estimate = coarse.estimate(&step, 1e-2, numbers);
        let off = (step.force / fine_step.force - 1.0).abs();
        assert!(off < estimate.force && estimate.force < 10.0 * off, "{off} {}", estimate.force);
        for (axis, number) in estimate.numbers.iter().enumerate() {
            let off = (at_point(&fine, x, axis).value / number.value - 1.0).abs();
            assert!(off < number.error && number.error < 30.0 * off, "{axis}: {off} {}", number.error);
        }
    }

    #[test]
    fn errors_estimated_on_a_coarse_mesh_cover_what_a_fine_one_finds() {
        covers(in_plane(4), in_plane(16), [0.8, 0.6]);
        covers(in_space(2), in_space(6), [0.6, 0.5, 0.5]);
    }

    #[test]
    fn elements_are_marked_where_their_share_is_largest_and_along_the_axes_that_need_it() {
        let share = |error: f64, axes: u8| Share { error, axes };
        let estimate = |elements: Vec<Share>| Estimate { force: 0.1, numbers: Vec::new(), elements };
        let first = estimate(vec![share(1.0, 1), share(0.1, 7), share(0.2, 2), share(0.0, 7)]);
        let second = estimate(vec![share(0.1, 4), share(0.1, 7), share(5.0, 4), share(0.0, 7)]);
        assert_eq!(marks(&[&first], 1.25, |_, axes| axes), Some(vec![1, 0, 0, 0]));
        assert_eq!(marks(&[&first, &second], 1.5, |_, axes| axes), Some(vec![1, 0, 4, 0]));
        assert_eq!(
            marks(&[&first], 1.25, |e, axes| if e == 0 { axes & !1 } else { axes }),
            Some(vec![0, 0, 2, 0])
        );
        assert_eq!(marks(&[], 2.0, |_, axes| axes), None);
    }

    #[test]
    fn a_step_that_is_known_to_be_estimated_leaves_the_layer_where_it_was() {
        let mut layer = in_plane(4);
        let step: LayerStep = layer.press(0.1, &NewtonSettings::default()).unwrap();
        let before = layer.state().clone();
        let numbers = vec![at_point(&layer, [0.8, 0.6], 1)];
        layer.estimate(&step, 1e-2, numbers);
        assert_eq!(layer.state(), &before);
        assert!((layer.step(step.effort).force - step.force).abs() <= 1e-12 * step.force);
    }
}
