//! A scene reduced to a plan and an axis: outlines, the planes at which bodies begin and end, and the filling
//! of each column over the plan.

use super::columns::{Chain, ChainOfSide, Column};
use super::marks::{dielectric_edges, marks};
use elastocap_geometry::meshing::grid::Plane;
use elastocap_geometry::meshing::plane::graded::{Circle, Coarse, Marks, Outline, Triangles, coarse};
use elastocap_geometry::recognition::{Prism, boxes_of, prisms_of};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall, across};
use elastocap_geometry::shapes::Shape;
use std::collections::{HashMap, HashSet};

/// Largest number of cells in the grid of a surface's coordinates when the surface is tested for consisting
/// of boxes. The limit is that of `validate/recognised.rs` in elastocap-case, which says how it was measured.
const MAX_CELLS: usize = 12_000;

/// Coordinates along the axis that differ by less than this share of the scene's size count as equal. Not
/// tuned: it only has to lie above rounding errors and below distances that matter.
const SAME: f64 = 1e-12;

/// Coordinates of outlines that differ by less than this share of the scene's size count as equal. Not tuned:
/// it only has to lie above rounding errors and below distances that matter.
const ALIKE: f64 = 1e-11;

/// Thickness along the axis below which a conductor counts as a sheet, over the size of all conductors.
/// Tuned: `benches/outlines.py discs`.
const SHEET: f64 = 1e-2;

/// Points that are closer to a sheet than this share of the scene's size lie on it. Not tuned: it only has to
/// lie above rounding errors and below distances that matter.
const ON_SHEET: f64 = 1e-10;

/// An outline pulled along the axis.
#[derive(Debug, Clone, PartialEq)]
struct Solid {
    /// Scaled outlines in the plan. The body lies over the points that an odd number of them contain: a
    /// second outline is a hole in the first.
    outlines: Vec<Outline>,
    /// Lower and upper end along the axis, scaled.
    ends: [f64; 2],
}

/// A scene of outlines pulled along one axis, in units of `unit`, from `origin`.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    /// The axis along which the outlines are pulled, 0 to 2.
    pub axis: usize,
    /// Unit of length, in m.
    pub unit: f64,
    /// Origin of the plan, the axis and the rays to infinity, in m.
    pub origin: [f64; 3],
    /// Planes along the axis at which something begins or ends, ascending.
    pub planes: Vec<Plane>,
    /// The walls at the lower and at the upper end of the axis.
    pub axis_walls: [Wall; 2],
    /// For each coordinate of the plan the walls on the lower and on the upper side.
    pub plan_walls: [[Wall; 2]; 2],
    /// Lower and upper corner of the plan, infinite where it is open.
    frame: [[f64; 2]; 2],
    /// Conducting bodies, each with the index of its conductor.
    conductors: Vec<(u32, Solid)>,
    /// Dielectric bodies, each with its permittivity; later ones override earlier ones.
    dielectrics: Vec<(f64, Solid)>,
    /// Relative permittivity where there is no body.
    background: f64,
    /// Distance from the origin beyond which nothing begins or ends.
    pub reach: f64,
}

/// Where infinite bodies are taken to end, in units of the scene: far beyond any frame. It is not tuned.
const FAR: f64 = 1e9;

impl Layout {
    /// The layout of a scene along `axis`; `None` where a body is not an outline pulled along it.
    pub(super) fn new(scene: &Scene, axis: usize) -> Option<Self> {
        let parts = |body: &Body| -> Option<Vec<Solid>> {
            let parts: Option<Vec<Vec<Solid>>> = body.parts.iter().map(|part| solids(part, axis)).collect();
            Some(parts?.into_iter().flatten().collect())
        };
        let mut conductors = Vec::new();
        for c in scene.conductors() {
            conductors.extend(parts(c.body)?.into_iter().map(|solid| (c.index as u32, solid)));
        }
        let mut dielectrics = Vec::new();
        for d in scene.dielectrics() {
            dielectrics.extend(parts(d.body)?.into_iter().map(|solid| (d.relative_permittivity, solid)));
        }
        let hull = scene.conductors().filter_map(|c| c.body.bounds()).reduce(|a, b| a.union(&b))?;
        let unit = (0..3).map(|a| hull.extent(a)).fold(0.0, f64::max);
        if !(unit.is_finite() && unit > 0.0) {
            return None;
        }
        let origin = [0, 1, 2].map(|a| match scene.walls[a].map(|w| w == Wall::Open) {
            [true, false] => scene.domain.max[a],
            [false, true] => scene.domain.min[a],
            _ => 0.5 * (hull.min[a] + hull.max[a]),
        });
        let [p, q] = across(axis);
        let scale = |x: f64, a: usize| ((x - origin[a]) / unit).clamp(-FAR, FAR);
        let place = |c: [f64; 2]| [scale(c[0], p), scale(c[1], q)];
        let scaled = |solid: Solid| Solid {
            outlines: solid.outlines.iter().map(|outline| outline.moved(place, 1.0 / unit)).collect(),
            ends: solid.ends.map(|z| scale(z, axis)),
        };
        let conductors: Vec<(u32, Solid)> = conductors.into_iter().map(|(c, s)| (c, scaled(s))).collect();
        let dielectrics: Vec<(f64, Solid)> = dielectrics.into_iter().map(|(e, s)| (e, scaled(s))).collect();
        let limits = [scene.domain.min, scene.domain.max].map(|corner| {
            [0, 1, 2].map(|a| if corner[a].is_finite() { scale(corner[a], a) } else { corner[a] })
        });
        let frame = limits.map(|corner| [corner[p], corner[q]]);
        let ends = limits.map(|corner| corner[axis]);
        let (mut conductors, mut dielectrics) = (conductors, dielectrics);
        for k in 0..2 {
            let bodies = conductors.iter_mut().map(|(_, s)| s).chain(dielectrics.iter_mut().map(|(_, s)| s));
            let corners: Vec<&mut [f64; 2]> =
                bodies.flat_map(|solid| solid.outlines.iter_mut().flat_map(Outline::places_mut)).collect();
            join(corners.into_iter().map(|c| &mut c[k]).collect(), frame.map(|corner| corner[k]));
        }
        // Bodies beyond the ends, such as mirror images, are dropped.
        let is_inside = |solid: &Solid| solid.ends[0] <= ends[1] && solid.ends[1] >= ends[0];
        let conductors: Vec<(u32, Solid)> = conductors.into_iter().filter(|(_, s)| is_inside(s)).collect();
        let dielectrics: Vec<(f64, Solid)> = dielectrics.into_iter().filter(|(_, s)| is_inside(s)).collect();
        let planes = planes(&conductors, &dielectrics, ends);
        let is_in_frame = |x: f64, k: usize| x > frame[0][k] && x < frame[1][k] && x.abs() < FAR;
        let solids = || conductors.iter().map(|(_, s)| s).chain(dielectrics.iter().map(|(_, s)| s));
        let plan = solids()
            .flat_map(|s| &s.outlines)
            .flat_map(Outline::extremes)
            .flat_map(|c| [0, 1].map(|k| (c[k], k)));
        let farthest = plan.filter(|(x, k)| is_in_frame(*x, *k)).map(|(x, _)| x.abs());
        let closed = (0..2).flat_map(|k| frame.map(|corner| corner[k].abs())).filter(|x| x.is_finite());
        let reach = farthest.chain(planes.iter().map(|p| p.at.abs())).chain(closed).fold(0.5, f64::max);
        Some(Self {
            axis,
            unit,
            origin,
            planes,
            axis_walls: scene.walls[axis],
            plan_walls: [scene.walls[p], scene.walls[q]],
            frame,
            conductors,
            dielectrics,
            background: scene.background_permittivity,
            reach,
        })
    }

    /// Whether flux can leave to infinity on some side.
    pub(super) fn is_open(&self) -> bool {
        self.axis_walls.contains(&Wall::Open) || self.plan_walls.iter().flatten().any(|w| *w == Wall::Open)
    }

    /// Whether both sides of some axis are closed while another is open.
    pub(super) fn is_confined(&self) -> bool {
        let closed = |walls: &[Wall; 2]| !walls.contains(&Wall::Open);
        self.is_open() && (closed(&self.axis_walls) || self.plan_walls.iter().any(closed))
    }

    /// The distance between the ends of a closed axis.
    pub(super) fn width(&self, axis: usize) -> f64 {
        match across(self.axis).iter().position(|a| *a == axis) {
            Some(k) => self.frame[1][k] - self.frame[0][k],
            None => self.planes.last().map_or(0.0, |p| p.at) - self.planes.first().map_or(0.0, |p| p.at),
        }
    }

    /// Whether a conductor has no thickness, or so little along the axis that its two edges act like that of
    /// a sheet.
    pub(super) fn has_sheets(&self) -> bool {
        let is_sheet = |solid: &Solid| solid.ends[1] - solid.ends[0] < SHEET || solid.segment().is_some();
        self.conductors.iter().any(|(_, solid)| is_sheet(solid))
    }

    /// Whether some conductors are sheets parallel to the axis.
    pub(super) fn has_upright_sheets(&self) -> bool {
        self.conductors.iter().any(|(_, solid)| solid.segment().is_some())
    }

    /// The number of intervals along the axis.
    pub(super) fn intervals(&self) -> usize {
        self.planes.len() - 1 + self.axis_walls.iter().filter(|w| **w == Wall::Open).count()
    }

    /// The frame of the plan, with open sides at the distance `radius` from the origin.
    fn frame(&self, radius: f64) -> [[f64; 2]; 2] {
        let limit = |x: f64| if x.is_finite() { x } else { radius.copysign(x) };
        self.frame.map(|corner| corner.map(limit))
    }

    /// The planes along the axis; those where the dielectrics of a plan have edges are marked as edges too.
    pub(super) fn planes_at_dielectrics(&self, plan: &Plan) -> Vec<Plane> {
        let shift = usize::from(self.axis_walls[0] == Wall::Open);
        let mut planes = self.planes.clone();
        for cut in plan.dielectric_edges() {
            if let Some(plane) = cut.checked_sub(shift).and_then(|k| planes.get_mut(k)) {
                plane.edge = true;
            }
        }
        planes
    }

    /// The number of the cut (see [`Column`]) at a coordinate along the axis.
    fn cut(&self, at: f64) -> usize {
        let distance = |k: &usize| (self.planes[*k].at - at).abs();
        let nearest = (0..self.planes.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
        let shift = usize::from(self.axis_walls[0] == Wall::Open);
        let reach = self.planes.iter().map(|p| p.at.abs()).fold(0.0, f64::max);
        if at > 2.0 * reach + 1.0 {
            self.intervals()
        } else if at < -2.0 * reach - 1.0 {
            0
        } else {
            nearest + shift
        }
    }

    /// The column of space over a point of the plan.
    ///
    /// # Errors
    /// The numbers of two conductors that touch or overlap there.
    fn column(&self, point: [f64; 2]) -> Result<Column, [u32; 2]> {
        let intervals = self.intervals();
        let mut column = Column {
            conductor: vec![None; intervals],
            held: vec![None; intervals + 1],
            permittivity: vec![self.background; intervals],
        };
        for (permittivity, solid) in &self.dielectrics {
            if solid.holds(point) {
                let [lo, hi] = solid.ends.map(|z| self.cut(z));
                column.permittivity[lo..hi.max(lo)].fill(*permittivity);
            }
        }
        for (conductor, solid) in &self.conductors {
            if solid.holds(point) {
                let [lo, hi] = solid.ends.map(|z| self.cut(z));
                for held in &mut column.held[lo..=hi.max(lo)] {
                    match held {
                        Some(other) if other != conductor => {
                            return Err([(*other).min(*conductor), (*other).max(*conductor)]);
                        }
                        _ => *held = Some(*conductor),
                    }
                }
                column.conductor[lo..hi.max(lo)].fill(Some(*conductor));
            }
        }
        Ok(column)
    }

    /// The chain over the segment between two points of the plan; `None` if no sheet stands over it. No sheet
    /// stands over a part of the segment alone.
    ///
    /// # Errors
    /// The numbers of two conductors that touch or overlap there.
    fn chain(&self, ends: [[f64; 2]; 2]) -> Result<Option<Chain>, [u32; 2]> {
        let sheets = || self.conductors.iter().filter(|(_, solid)| solid.stands_over(ends));
        if sheets().next().is_none() {
            return Ok(None);
        }
        let intervals = self.intervals();
        let mut chain = Chain { conductor: vec![None; intervals], held: vec![None; intervals + 1] };
        for (conductor, solid) in sheets() {
            let [lo, hi] = solid.ends.map(|z| self.cut(z));
            let cuts: Vec<Option<u32>> =
                (0..=intervals).map(|m| (lo..=hi).contains(&m).then_some(*conductor)).collect();
            join_held(&mut chain.held, &cuts)?;
            chain.conductor[lo..hi.max(lo)].fill(Some(*conductor));
        }
        Ok(Some(chain))
    }

    /// The chains of a mesh, and the sides of triangles that belong to each.
    ///
    /// # Errors
    /// The numbers of two conductors that touch or overlap.
    fn chains(&self, mesh: &Triangles) -> Result<(Vec<Chain>, ChainOfSide), [u32; 2]> {
        let mut chains: Vec<Chain> = Vec::new();
        let mut of_side = ChainOfSide::new();
        if !self.has_upright_sheets() {
            return Ok((chains, of_side));
        }
        for [a, b, c] in &mesh.triangles {
            for [p, q] in [[*a, *b], [*b, *c], [*c, *a]] {
                let Some(chain) = self.chain([p, q].map(|p| mesh.points[p as usize]))? else { continue };
                let known = chains.iter().position(|known| *known == chain).unwrap_or(chains.len());
                if known == chains.len() {
                    chains.push(chain);
                }
                of_side.insert([p.min(q), p.max(q)], known as u32);
            }
        }
        Ok((chains, of_side))
    }

    /// The coarsest mesh of the plan, to be graded toward the edges of conductors and, if `at_dielectrics`,
    /// of dielectrics.
    ///
    /// # Errors
    /// See [`PlanError`].
    pub(super) fn plan(&self, radius: f64, at_dielectrics: bool) -> Result<Plan, PlanError> {
        let frame = self.frame(radius);
        let solids = self.conductors.iter().map(|(_, s)| s).chain(self.dielectrics.iter().map(|(_, s)| s));
        let outlines: Vec<Outline> = solids.flat_map(|s| s.outlines.iter().cloned()).collect();
        let coarse = coarse(&outlines, frame).ok_or(PlanError::NoMesh)?;
        let mesh = &coarse.mesh;
        let mut columns: Vec<Column> = Vec::new();
        let mut of_triangle = Vec::with_capacity(mesh.triangles.len());
        for t in &mesh.triangles {
            let column = self.column(coarse.middle(t)).map_err(PlanError::Touching)?;
            let known = columns.iter().position(|c| *c == column);
            of_triangle.push(known.unwrap_or(columns.len()) as u32);
            if known.is_none() {
                columns.push(column);
            }
        }
        let mut held = held_over_points(mesh, &of_triangle, &columns).map_err(PlanError::Touching)?;
        let (chains, of_side) = self.chains(mesh).map_err(PlanError::Touching)?;
        for (side, chain) in &of_side {
            for p in side {
                join_held(&mut held[*p as usize], &chains[*chain as usize].held)
                    .map_err(PlanError::Touching)?;
            }
        }
        if let Some(c) = self.on_a_grounded_wall(&mesh.points, &held, frame) {
            return Err(PlanError::OnGround(c));
        }
        let marks = marks(&coarse, &of_triangle, &columns, frame, (&chains, of_side), at_dielectrics);
        Ok(Plan { coarse, columns, of_triangle, chains, marks, frame })
    }
}

impl Layout {
    /// A conductor that touches a grounded wall, if there is one.
    fn on_a_grounded_wall(
        &self,
        points: &[[f64; 2]],
        held: &[Vec<Option<u32>>],
        frame: [[f64; 2]; 2],
    ) -> Option<u32> {
        let grounded = |wall: Wall| wall == Wall::Grounded;
        points.iter().zip(held).find_map(|(point, held)| {
            let on_side =
                |k: usize, side: usize| point[k] == frame[side][k] && grounded(self.plan_walls[k][side]);
            let on_a_side = (0..2).any(|k| (0..2).any(|side| on_side(k, side)));
            let ends = [held.first(), held.last()].into_iter().zip(self.axis_walls);
            let at_end =
                ends.filter(|(_, wall)| grounded(*wall)).find_map(|(held, _)| held.copied().flatten());
            at_end.or_else(|| held.iter().flatten().next().copied().filter(|_| on_a_side))
        })
    }
}

/// Why a layout has no plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PlanError {
    /// There is no mesh of a reasonable size.
    NoMesh,
    /// Two conductors, given by their numbers, touch or overlap.
    Touching([u32; 2]),
    /// The conductor with this number touches a grounded wall.
    OnGround(u32),
}

/// For each point of a mesh the conductor that each cut belongs to there.
///
/// # Errors
/// The numbers of two conductors that share a cut at a point.
fn held_over_points(
    mesh: &Triangles,
    of_triangle: &[u32],
    columns: &[Column],
) -> Result<Vec<Vec<Option<u32>>>, [u32; 2]> {
    let mut held: Vec<Vec<Option<u32>>> = vec![Vec::new(); mesh.points.len()];
    for (t, column) in mesh.triangles.iter().zip(of_triangle) {
        let column_held = &columns[*column as usize].held;
        for p in t {
            let point_held = &mut held[*p as usize];
            point_held.resize(column_held.len(), None);
            join_held(point_held, column_held)?;
        }
    }
    Ok(held)
}

/// Adds to `held` the conductors that the cuts belong to in another place.
///
/// # Errors
/// The numbers of two conductors that share a cut.
fn join_held(held: &mut [Option<u32>], other: &[Option<u32>]) -> Result<(), [u32; 2]> {
    for (held, other) in held.iter_mut().zip(other) {
        match (*held, *other) {
            (Some(a), Some(b)) if a != b => return Err([a.min(b), a.max(b)]),
            (None, Some(b)) => *held = Some(b),
            _ => {}
        }
    }
    Ok(())
}

/// The coarsest mesh of a plan, with the columns over its triangles and the places where it has to be graded.
#[derive(Debug)]
pub(super) struct Plan {
    pub coarse: Coarse,
    /// The different columns over the triangles.
    pub columns: Vec<Column>,
    /// The column of each triangle.
    pub of_triangle: Vec<u32>,
    /// The chains, as numbered in `marks`.
    pub chains: Vec<Chain>,
    /// The places where the mesh has to be graded.
    pub marks: Marks,
    /// Lower and upper corner of the plan.
    pub frame: [[f64; 2]; 2],
}

impl Plan {
    /// The cuts at which dielectrics have edges across the axis, in no order and some of them more than once.
    pub(super) fn dielectric_edges(&self) -> impl Iterator<Item = usize> + '_ {
        let mut beside: HashMap<[u32; 2], u32> = HashMap::new();
        let mut pairs: HashSet<[u32; 2]> = HashSet::new();
        for ([a, b, c], column) in self.coarse.mesh.triangles.iter().zip(&self.of_triangle) {
            for [p, q] in [[*a, *b], [*b, *c], [*c, *a]] {
                let other = *beside.entry([p.min(q), p.max(q)]).or_insert(*column);
                if other != *column {
                    pairs.insert([other.min(*column), other.max(*column)]);
                }
            }
        }
        let columns = |pair: [u32; 2]| pair.map(|column| &self.columns[column as usize]);
        pairs.into_iter().map(columns).flat_map(|[one, other]| dielectric_edges(one, other))
    }
}

/// The outlines pulled along an axis that a shape consists of, in m; `None` for other shapes.
fn solids(shape: &Shape, axis: usize) -> Option<Vec<Solid>> {
    let [p, q] = across(axis);
    match shape {
        Shape::Extrusion { axis: along, from, to, outline, arcs } if *along == axis => Some(vec![Solid {
            outlines: vec![Outline::with_arcs(outline, arcs)],
            ends: [from.min(*to), from.max(*to)],
        }]),
        Shape::Cylinder { axis: along, base, radius, height } if *along == axis => {
            let outline = Outline::Circle(Circle { center: [base[p], base[q]], radius: *radius });
            Some(vec![Solid { outlines: vec![outline], ends: [base[axis], base[axis] + height] }])
        }
        Shape::Tube { axis: along, base, radii: [inner, outer], height } if *along == axis => {
            let circle = |radius| Outline::Circle(Circle { center: [base[p], base[q]], radius });
            let ends = [base[axis], base[axis] + height];
            Some(vec![Solid { outlines: vec![circle(*outer), circle(*inner)], ends }])
        }
        Shape::Surface(surface) => {
            let solid = |prism: Prism| Solid {
                outlines: prism.outlines.iter().map(|outline| Outline::polygon(outline)).collect(),
                ends: prism.ends,
            };
            Some(prisms_of(surface, axis)?.into_iter().map(solid).collect())
        }
        Shape::Box(_) | Shape::Extrusion { .. } => {
            let boxes = boxes_of(shape, MAX_CELLS)?;
            let solid = |b: &Box3| {
                let flat = [p, q, axis].map(|a| b.min[a] == b.max[a]);
                let [low, high] = [[b.min[p], b.min[q]], [b.max[p], b.max[q]]];
                let corners = match flat {
                    [false, false, _] => vec![low, [high[0], low[1]], high, [low[0], high[1]]],
                    [true, false, false] | [false, true, false] => vec![low, high],
                    // A box that is flat along two axes or more.
                    _ => return None,
                };
                Some(Solid { outlines: vec![Outline::polygon(&corners)], ends: [b.min[axis], b.max[axis]] })
            };
            boxes.iter().map(solid).collect()
        }
        Shape::Sphere { .. }
        | Shape::Shell { .. }
        | Shape::Capsule { .. }
        | Shape::Cylinder { .. }
        | Shape::Tube { .. }
        | Shape::Physical(_) => None,
    }
}

impl Solid {
    /// The segment of the plan over which the body stands, if it is a sheet parallel to the axis.
    fn segment(&self) -> Option<[[f64; 2]; 2]> {
        let [Outline::Path(sides)] = &self.outlines[..] else { return None };
        let &[a, b] = &sides[..] else { return None };
        (a.curve.is_none() && b.curve.is_none()).then_some([a.from, b.from])
    }

    /// Whether the body is a sheet that stands over this segment of the plan; it does not stand over a part
    /// of the segment alone.
    fn stands_over(&self, ends: [[f64; 2]; 2]) -> bool {
        let Some([a, b]) = self.segment() else { return false };
        let along = [b[0] - a[0], b[1] - a[1]];
        let square = along[0] * along[0] + along[1] * along[1];
        ends.iter().all(|p| {
            let from = [p[0] - a[0], p[1] - a[1]];
            let across = (along[0] * from[1] - along[1] * from[0]).abs() / square.sqrt();
            let share = (along[0] * from[0] + along[1] * from[1]) / square;
            let slack = ON_SHEET / square.sqrt();
            across <= ON_SHEET && share >= -slack && share <= 1.0 + slack
        })
    }

    /// Whether the body lies over a point of the plan.
    fn holds(&self, point: [f64; 2]) -> bool {
        self.outlines.iter().filter(|outline| outline.contains(point)).count() % 2 == 1
    }
}

/// Makes coordinates equal that differ by rounding alone, from each other or from the ends of the frame.
fn join(mut coordinates: Vec<&mut f64>, frame: [f64; 2]) {
    coordinates.sort_by(|a, b| a.total_cmp(b));
    let mut last = f64::NEG_INFINITY;
    for x in coordinates {
        let near = |other: f64| (*x - other).abs() <= ALIKE;
        let alike = frame.into_iter().chain([last]).find(|other| near(*other));
        *x = alike.unwrap_or(*x);
        last = *x;
    }
}

/// The coordinates along the axis at which something begins or ends between the ends of the scene.
fn planes(conductors: &[(u32, Solid)], dielectrics: &[(f64, Solid)], ends: [f64; 2]) -> Vec<Plane> {
    let inside = |at: f64| ends[0] < at && at < ends[1] && at.abs() < FAR;
    let end_planes = |solid: &Solid, edge: bool| solid.ends.map(|at| Plane { at, edge });
    let mut planes: Vec<Plane> = conductors.iter().flat_map(|(_, s)| end_planes(s, true)).collect();
    planes.extend(dielectrics.iter().flat_map(|(_, s)| end_planes(s, false)));
    planes.retain(|plane| inside(plane.at));
    planes.extend(ends.iter().filter(|at| at.is_finite()).map(|at| Plane { at: *at, edge: false }));
    planes.sort_by(|a, b| a.at.total_cmp(&b.at));
    let size = planes.iter().map(|p| p.at.abs()).fold(0.0, f64::max);
    let mut out: Vec<Plane> = Vec::new();
    for plane in planes {
        match out.last_mut() {
            Some(last) if plane.at - last.at <= SAME * size => last.edge |= plane.edge,
            _ => out.push(plane),
        }
    }
    out
}
