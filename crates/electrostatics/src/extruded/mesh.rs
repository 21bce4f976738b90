//! The graded mesh of a plan: triangles, sides, and the columns over them.

use super::columns::{Chain, Column};
use super::layout::Plan;
use elastocap_fem::bent::Bent;
use elastocap_fem::triangle::{SIDES, Triangle};
use elastocap_geometry::meshing::plane::graded::{Graded, Layers, graded};
use elastocap_geometry::scene::Wall;
use std::collections::HashMap;

/// A mesh of a plan. Triangles of one column and one distance follow one another.
#[derive(Debug)]
pub(super) struct PlanMesh {
    /// Places of the points, in units of the layout.
    pub points: Vec<[f64; 2]>,
    /// Corners of each triangle, ascending.
    pub triangles: Vec<[u32; 3]>,
    /// The bent triangle that each triangle is a part of, if it is, with the shares of its corners there.
    pub bent: Vec<Option<(Bent, [[f64; 2]; 3])>>,
    /// Sides of each triangle, in the order of [`SIDES`].
    pub sides: Vec<[u32; 3]>,
    /// Ends of each side, ascending.
    pub edges: Vec<[u32; 2]>,
    /// The side of the frame that each edge lies on, if any: which coordinate, and which of the two sides.
    pub on_frame: Vec<Option<[usize; 2]>>,
    /// The number of the column over each triangle.
    pub column: Vec<u32>,
    /// The columns, by their numbers.
    pub columns: Vec<Column>,
    /// The number of the chain that each edge belongs to, if it does.
    pub chain: Vec<Option<u32>>,
    /// The chains, by their numbers.
    pub chains: Vec<Chain>,
    /// For each triangle the squared distance of its farthest corner from the origin over that of the frame,
    /// in steps of [`DISTANCE_STEP`], rounded up.
    pub distance: Vec<u8>,
}

/// The step of [`PlanMesh::distance`].
pub(super) const DISTANCE_STEP: f64 = 0.125;

/// The bent triangle that `triangle` is a part of, and where the corners of the latter lie in it.
fn shares(triangle: &[u32; 3], bent: Bent, straight: &[[f64; 2]]) -> (Bent, [[f64; 2]; 3]) {
    (bent, triangle.map(|p| bent.shares(straight[p as usize])))
}

impl PlanMesh {
    /// Grades the mesh of a plan with these numbers of layers.
    pub(super) fn new(plan: &Plan, layers: Layers) -> Self {
        let Graded { mesh, parents, bent, straight, chains } = graded(&plan.coarse, &plan.marks, layers);
        let half = plan.frame.iter().flatten().map(|x| x.abs()).fold(0.0, f64::max);
        let distance = |t: &[u32; 3]| {
            let squares = t.map(|p| mesh.points[p as usize].iter().map(|x| x * x).sum::<f64>());
            (squares.into_iter().fold(0.0, f64::max) / (half * half * DISTANCE_STEP)).ceil() as u8
        };
        let mut triangles: Vec<(u32, u8, [u32; 3], Option<Bent>)> = mesh
            .triangles
            .iter()
            .zip(parents.iter().zip(&bent))
            .map(|(t, (parent, bent))| {
                let mut corners = *t;
                corners.sort_unstable();
                (plan.of_triangle[*parent as usize], distance(t), corners, *bent)
            })
            .collect();
        triangles.sort_by_key(|(column, distance, ..)| (*column, *distance));
        let mut numbers: HashMap<[u32; 2], u32> = HashMap::new();
        let mut edges = Vec::new();
        let sides = triangles
            .iter()
            .map(|(_, _, t, _)| {
                SIDES.map(|ends| {
                    let edge = ends.map(|c| t[c]);
                    *numbers.entry(edge).or_insert_with(|| {
                        edges.push(edge);
                        (edges.len() - 1) as u32
                    })
                })
            })
            .collect();
        let frame = plan.frame;
        let frame_sides_at = |p: [f64; 2]| [0, 1].map(|k| [0, 1].map(|side: usize| p[k] == frame[side][k]));
        let on_frame = edges
            .iter()
            .map(|edge: &[u32; 2]| {
                let [a, b] = edge.map(|p| frame_sides_at(mesh.points[p as usize]));
                let places = [[0, 0], [0, 1], [1, 0], [1, 1]];
                places.into_iter().find(|[k, side]| a[*k][*side] && b[*k][*side])
            })
            .collect();
        Self {
            points: mesh.points,
            triangles: triangles.iter().map(|(_, _, t, _)| *t).collect(),
            bent: triangles
                .iter()
                .map(|(_, _, t, bent)| bent.map(|bent| shares(t, bent, &straight)))
                .collect(),
            sides,
            chain: edges.iter().map(|edge| chains.get(edge).copied()).collect(),
            chains: plan.chains.clone(),
            edges,
            on_frame,
            column: triangles.iter().map(|(column, ..)| *column).collect(),
            distance: triangles.iter().map(|(_, distance, ..)| *distance).collect(),
            columns: plan.columns.clone(),
        }
    }

    /// The geometry of a triangle.
    pub(super) fn triangle(&self, t: usize) -> Triangle {
        Triangle { corners: self.triangles[t].map(|p| self.points[p as usize]), bent: self.bent[t] }
    }

    /// The column over a triangle.
    pub(super) fn column_of(&self, t: usize) -> &Column {
        &self.columns[self.column[t] as usize]
    }

    /// The edges that belong to chains, each with its chain.
    pub(super) fn on_chains(&self) -> impl Iterator<Item = (usize, u32)> + '_ {
        self.chain.iter().enumerate().filter_map(|(e, chain)| Some((e, (*chain)?)))
    }

    /// The middle of an edge.
    pub(super) fn middle(&self, edge: usize) -> [f64; 2] {
        let [a, b] = self.edges[edge].map(|p| self.points[p as usize]);
        [0, 1].map(|k| 0.5 * (a[k] + b[k]))
    }

    /// The length of an edge.
    pub(super) fn length(&self, edge: usize) -> f64 {
        let [a, b] = self.edges[edge].map(|p| self.points[p as usize]);
        (a[0] - b[0]).hypot(a[1] - b[1])
    }

    /// The wall on the side of the frame that an edge lies on; `None` for an edge inside the frame.
    pub(super) fn wall(&self, edge: usize, walls: &[[Wall; 2]; 2]) -> Option<Wall> {
        self.on_frame[edge].map(|[k, side]| walls[k][side])
    }
}
