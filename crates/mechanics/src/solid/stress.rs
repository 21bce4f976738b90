//! Cauchy stress of a state: at points of an element, and as one continuous field with a value at every node.
//!
//! # Nodal values
//! The gradient of a biquadratic displacement is accurate inside an element and poor at its nodes. Each
//! element's values at the nine quadrature points are therefore fitted by a bilinear polynomial of the
//! reference square, and the values of the elements around a node are averaged, weighted by area. Away from
//! singular points the error falls with the square of the element size. Where two materials meet, stress and
//! `J` may jump, and the average blurs the jump: there, use [`Equations::stress_in`].

use rayon::prelude::*;

use super::element::{Mapped, POINTS, shape_functions};
use super::mesh::Mesh;
use super::model::{Equations, State};
use super::shape_functions::linear_fit_weights;

pub use super::point_stress::PointStress;

/// Displacement and stress at a point of the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Reference position in m.
    pub reference: [f64; 2],
    /// Displacement in m.
    pub displacement: [f64; 2],
    /// Stress and change of volume.
    pub stress: PointStress,
}

/// A state as fields: displacement and stress at the nodes and anywhere in between.
#[derive(Debug, Clone)]
pub struct Fields<'a> {
    mesh: &'a Mesh,
    state: &'a State,
    /// The stress at each node.
    nodal: Vec<PointStress>,
}

impl Equations {
    /// Stress in `state` at the point `(s, t)` of the reference square of element `e`, from the shape
    /// functions of the element. `None` where the element is collapsed, at the centre of a fan.
    ///
    /// # Panics
    /// If there is no element `e`, or `state` is not one of this body.
    pub fn stress_in(&self, state: &State, e: usize, [s, t]: [f64; 2]) -> Option<PointStress> {
        let body = self.body();
        let nodes = body.mesh.elements[e].map(|n| body.mesh.nodes[n as usize]);
        let point = Mapped::new(&nodes, s, t)?;
        let f = point.deformation_gradient(&self.gather(e, &state.displacement));
        let basis = self.elements[e].pressure_basis(point.place);
        Some(PointStress::new(
            &body.rubbers[body.material[e] as usize],
            &f,
            pressure_value(&basis, &state.pressure[e]),
        ))
    }

    /// Stress in `state` at the nine nodes of element `e`, from the bilinear fit to its quadrature points.
    ///
    /// # Panics
    /// As [`Equations::stress_in`].
    pub fn element_stress(&self, state: &State, e: usize) -> [PointStress; 9] {
        let (body, element) = (self.body(), &self.elements[e]);
        let rubber = &body.rubbers[body.material[e] as usize];
        let u = self.gather(e, &state.displacement);
        let at_points: [PointStress; POINTS] = std::array::from_fn(|q| {
            let f = element.deformation_gradient(q, &u);
            PointStress::new(rubber, &f, pressure_value(&element.pressure[q], &state.pressure[e]))
        });
        std::array::from_fn(|n| PointStress::blend(&at_points, &extrapolation(n)))
    }

    /// Displacement and stress of `state` as fields.
    ///
    /// # Panics
    /// If `state` is not one of this body.
    pub fn fields<'a>(&'a self, state: &'a State) -> Fields<'a> {
        let mesh = &self.body().mesh;
        let of_elements: Vec<[PointStress; 9]> = (0..mesh.elements.len())
            .into_par_iter()
            .with_min_len(64)
            .map(|e| self.element_stress(state, e))
            .collect();
        let mut nodal = vec![PointStress::default(); mesh.nodes.len()];
        let mut area = vec![0.0; mesh.nodes.len()];
        for (e, values) in of_elements.iter().enumerate() {
            let weight = self.elements[e].area();
            for (n, value) in mesh.elements[e].iter().zip(values) {
                nodal[*n as usize].add(weight, value);
                area[*n as usize] += weight;
            }
        }
        for (value, area) in nodal.iter_mut().zip(&area) {
            *value = PointStress::blend(&[*value], &[1.0 / area]);
        }
        Fields { mesh, state, nodal }
    }
}

impl Fields<'_> {
    /// The stress at each node of the mesh; see the module's head.
    pub fn nodal(&self) -> &[PointStress] {
        &self.nodal
    }

    /// The sample at node `n`.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn at_node(&self, n: usize) -> Sample {
        Sample {
            reference: self.mesh.nodes[n],
            displacement: [self.state.displacement[2 * n], self.state.displacement[2 * n + 1]],
            stress: self.nodal[n],
        }
    }

    /// The sample at the reference position `x` (m), or `None` outside the body.
    pub fn at(&self, x: [f64; 2]) -> Option<Sample> {
        let Some((e, [s, t])) = self.mesh.locate(x) else {
            // The centre of a fan has no unique coordinates in the reference square of an element.
            let n = self.mesh.nearest_node(x);
            return (self.mesh.nodes[n] == x).then(|| Sample { reference: x, ..self.at_node(n) });
        };
        let shape = shape_functions(s, t);
        let nodes = self.mesh.elements[e].map(|n| n as usize);
        let displacement =
            [0, 1].map(|k| (0..9).map(|a| shape[a] * self.state.displacement[2 * nodes[a] + k]).sum());
        let stress = PointStress::blend(&nodes.map(|n| self.nodal[n]), &shape);
        Some(Sample { reference: x, displacement, stress })
    }

    /// Samples at `count` equal distances on the straight reference line between `from` and `to` (m), both
    /// included; those outside the body are left out.
    pub fn along(&self, from: [f64; 2], to: [f64; 2], count: usize) -> Vec<Sample> {
        let part = |k: usize| k as f64 / (count.max(2) - 1) as f64;
        let point = |r: f64| std::array::from_fn(|k| (1.0 - r) * from[k] + r * to[k]);
        (0..count).filter_map(|k| self.at(point(part(k)))).collect()
    }

    /// Samples at the nodes of the boundary whose reference position satisfies `on`, by ascending `x1`, then
    /// `x2`: the bonded edge with `|x| x[1] == 0.0`, for instance.
    pub fn on_boundary(&self, on: impl Fn([f64; 2]) -> bool) -> Vec<Sample> {
        let mut nodes: Vec<usize> =
            self.mesh.boundary_where(on).iter().flat_map(|edge| edge.nodes).map(|n| n as usize).collect();
        let place = |n: usize| self.mesh.nodes[n];
        let order = |a: &usize, b: &usize| {
            let (p, q) = (place(*a), place(*b));
            p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])).then(a.cmp(b))
        };
        nodes.sort_unstable_by(order);
        nodes.dedup();
        nodes.into_iter().map(|n| self.at_node(n)).collect()
    }
}

/// The pressure field's value from its basis and its coefficients.
fn pressure_value(basis: &[f64; 3], coefficients: &[f64; 3]) -> f64 {
    basis.iter().zip(coefficients).map(|(b, c)| b * c).sum()
}

/// The weights with which the values at the nine quadrature points give the value at node `n` of their
/// bilinear fit: least squares with the weights of the quadrature, that is, the projection onto
/// `1, s, t, st`.
fn extrapolation(n: usize) -> [f64; POINTS] {
    let (a, b) = (linear_fit_weights(n % 3), linear_fit_weights(n / 3));
    std::array::from_fn(|q| a[q % 3] * b[q / 3])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bilinear_function_of_the_reference_square_is_extrapolated_as_it_is() {
        let (points, _) = elastocap_fem::quadrature::gauss_legendre(3);
        let f = |s: f64, t: f64| 1.0 - 2.0 * s + 0.5 * t + 3.0 * s * t;
        for n in 0..9 {
            let weights = extrapolation(n);
            let sum: f64 = (0..POINTS).map(|q| weights[q] * f(points[q % 3], points[q / 3])).sum();
            assert!((sum - f((n % 3) as f64 - 1.0, (n / 3) as f64 - 1.0)).abs() < 1e-13);
        }
    }
}
