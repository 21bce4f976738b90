//! Files for other programs: the bodies of all steps as glTF, the field of each step as VTK.

use elastocap_electrostatics::{CellBody, Field};
use elastocap_geometry::export::gltf::{BodyRole, SceneBody, part_name, round_length};
use elastocap_geometry::export::surfaces::SurfaceBody;
use elastocap_geometry::export::vtk::FieldGrid;
use elastocap_geometry::meshing::grid::{End, Plane, Resolution, graded_axis};
use elastocap_geometry::scene::{Box3, Filling, Scene, Wall};

use elastocap_case::{Case, Mechanics};
use elastocap_coupling::load_steps::StepLoad;
use elastocap_coupling::outcome::StepResult;
use elastocap_coupling::scene::DeformedScene;
use elastocap_coupling::view::window;
use elastocap_coupling::words::prefixed;

use crate::indenter::{indenter, of_box, plate};

/// The gap between bodies and drawn walls, as a share of their extent: coplanar faces flicker in a viewer.
const APART: f64 = 2e-3;
/// Thickness of the substrate where none is part of the field, over that of the layer.
const SLAB: f64 = 0.25;
/// Largest length of the scale bar, its thickness, and its distance from the bodies, over their largest
/// extent.
const BAR: [f64; 3] = [0.4, 0.01, 0.05];

/// The place of a body in a state of the scene, if the body is there.
type Pose<'a> = &'a dyn Fn(&DeformedScene) -> Option<Box3>;

/// The bodies of a case with their pose at every step that has one, and labels of those steps.
pub fn bodies(case: &Case, steps: &[StepResult]) -> (Vec<SceneBody>, Vec<String>) {
    let known: Vec<(&StepResult, &DeformedScene)> =
        steps.iter().filter_map(|step| Some((step, step.scene.as_ref()?))).collect();
    let Some((_, first)) = known.first() else { return layer_alone(case, steps) };
    let labels = known.iter().map(|(step, _)| label(step)).collect();
    let scenes: Vec<&DeformedScene> = known.iter().map(|(_, scene)| *scene).collect();
    let window = window(&scenes);

    let mut bodies: Vec<SceneBody> = Vec::new();
    let mut add = |name: &str, role, pose: Pose<'_>| {
        let poses: Option<Vec<_>> = scenes.iter().map(|scene| pose(scene)).collect();
        if let Some(poses) = poses {
            let mut name = name.to_owned();
            while bodies.iter().any(|body| body.name == name) {
                name.push('\'');
            }
            bodies.push(SceneBody { name, role, poses });
        }
    };
    for conductor in first.scene.conductors() {
        for k in 0..conductor.body.parts.len() {
            add(&part_name(&conductor.body.name, k), BodyRole::from(conductor.body), &|s| {
                s.scene.conductors().nth(conductor.index)?.body.parts.get(k)?.as_box()
            });
        }
    }
    for dielectric in first.scene.dielectrics() {
        let name = &dielectric.body.name;
        for k in 0..dielectric.body.parts.len() {
            add(&part_name(name, k), BodyRole::from(dielectric.body), &|s| {
                // A moving wall may remove a body from the scene.
                let namesake = s.scene.dielectrics().find(|d| d.body.name == *name)?;
                let region = namesake.body.parts.get(k)?.as_box()?;
                solid(intersection(&intersection(&region, &s.scene.domain), &window))
            });
        }
    }
    walls(first, &window, &mut add);
    let steps: Vec<&StepResult> = known.iter().map(|(step, _)| *step).collect();
    add_surroundings_of_layer(case, &steps, &mut bodies);
    bodies.extend(scale_bar(&bodies));
    (bodies, labels)
}

/// The height of the indenter's lowest point at a step, m.
fn height(case: &Case, step: &StepResult) -> Option<f64> {
    let distance = step.row.distance_m.unwrap_or(0.0);
    Some(case.layer.as_ref()?.thickness - step.row.top_displacement_m? + distance)
}

/// Adds the pressing plate, if the indenter is one, and a substrate where the field ends at the bottom of the
/// layer.
fn add_surroundings_of_layer(case: &Case, steps: &[&StepResult], bodies: &mut Vec<SceneBody>) {
    let Some(layer) = &case.layer else { return };
    let poses = |role| bodies.iter().find(|body| body.role == role).map(|body| body.poses.clone());
    let Some(layers) = poses(BodyRole::Layer) else { return };
    let has_indenter = poses(BodyRole::Indenter).is_some();
    if poses(BodyRole::Substrate).is_none() {
        bodies.push(SceneBody {
            name: "substrate".into(),
            role: BodyRole::Substrate,
            poses: layers.iter().map(|pose| slab(pose, layer.thickness)).collect(),
        });
    }
    // The plate reaches no farther than the layer is shown, and lies above the bodies on the layer.
    let plate_at = |(k, (step, layer)): (usize, (&&StepResult, &Box3))| {
        let mut plate = plate(case, height(case, step)?)?;
        let lift = on_layer(bodies, k, &plate) - plate.min[1];
        [plate.min[1], plate.max[1]] = [plate.min[1], plate.max[1]].map(|at| at + lift.max(0.0));
        for a in [0, 2] {
            plate.min[a] = plate.min[a].max(layer.min[a]);
            plate.max[a] = plate.max[a].min(layer.max[a]);
        }
        solid(plate)
    };
    let plates: Option<Vec<Box3>> = steps.iter().zip(&layers).enumerate().map(plate_at).collect();
    if let Some(poses) = plates.filter(|poses| !poses.is_empty() && !has_indenter) {
        bodies.push(SceneBody { name: "indenter".into(), role: BodyRole::Indenter, poses });
    }
}

/// The height of the highest point of the bodies under a plate at a step, m; minus infinity without such
/// bodies.
fn on_layer(bodies: &[SceneBody], step: usize, plate: &Box3) -> f64 {
    let solid = bodies.iter().filter(|body| match body.role {
        BodyRole::Conductor
        | BodyRole::FloatingConductor
        | BodyRole::GroundedConductor
        | BodyRole::Dielectric => true,
        BodyRole::Layer
        | BodyRole::Substrate
        | BodyRole::Cover
        | BodyRole::Wall
        | BodyRole::GroundedWall
        | BodyRole::Surroundings
        | BodyRole::Indenter
        | BodyRole::ScaleBar => false,
    });
    let under =
        |pose: &&Box3| [0, 2].iter().all(|&a| pose.min[a] < plate.max[a] && plate.min[a] < pose.max[a]);
    solid
        .filter_map(|body| body.poses.get(step))
        .filter(under)
        .map(|pose| pose.max[1])
        .fold(f64::NEG_INFINITY, f64::max)
}

/// A part of the substrate under a layer with these bounds and of this thickness.
fn slab(layer: &Box3, thickness: f64) -> Box3 {
    let mut slab = *layer;
    (slab.min[1], slab.max[1]) = (-SLAB * thickness, -APART * thickness);
    slab
}

/// A bar of a round length in front of the bodies.
fn scale_bar(bodies: &[SceneBody]) -> Option<SceneBody> {
    let is_around = |role| {
        matches!(role, BodyRole::Cover | BodyRole::Wall | BodyRole::GroundedWall | BodyRole::Surroundings)
    };
    let solid = bodies.iter().filter(|body| !is_around(body.role));
    let bounds = solid.flat_map(|body| &body.poses).copied().reduce(|bounds, pose| bounds.union(&pose))?;
    let (name, bar) = bar_before(&bounds)?;
    let steps = bodies.first().map_or(0, |body| body.poses.len());
    Some(SceneBody { name, role: BodyRole::ScaleBar, poses: vec![bar; steps] })
}

/// The name of a scale bar in front of bodies within these bounds, and the bar.
fn bar_before(bounds: &Box3) -> Option<(String, Box3)> {
    let size = (0..3).map(|a| bounds.extent(a)).fold(0.0, f64::max);
    let [most, thickness, apart] = BAR.map(|share| share * size);
    let (length, words) = round_length(most).ok()?;
    let min = [bounds.min[0], bounds.min[1], bounds.max[2] + apart];
    let max = [min[0] + length, min[1] + thickness, min[2] + thickness];
    Some((format!("scale bar {words}"), Box3 { min, max }))
}

/// The outer walls: one box where all have the same condition, else one sheet for each; an open boundary as a
/// box around what is shown.
fn walls(first: &DeformedScene, window: &Box3, add: &mut dyn FnMut(&str, BodyRole, Pose<'_>)) {
    let kinds = first.scene.walls;
    let shown = |scene: &DeformedScene| intersection(&scene.scene.domain, window);
    if kinds.iter().flatten().all(|kind| *kind == kinds[0][0]) {
        let (name, role) = match kinds[0][0] {
            Wall::Insulated => ("walls (insulated), drawn 0.2 % outside", BodyRole::Wall),
            Wall::Grounded => ("walls (grounded), drawn 0.2 % outside", BodyRole::GroundedWall),
            Wall::Open => ("open space (cut off)", BodyRole::Surroundings),
        };
        add(name, role, &|s| solid(grown(shown(s))));
        return;
    }
    if kinds.iter().flatten().any(|kind| *kind == Wall::Open) {
        add("open space (cut off)", BodyRole::Surroundings, &|s| solid(grown(shown(s))));
    }
    for (axis, sides) in kinds.iter().enumerate() {
        for (side, kind) in sides.iter().enumerate() {
            let (kind, role) = match kind {
                Wall::Insulated => ("insulated", BodyRole::Wall),
                Wall::Grounded => ("grounded", BodyRole::GroundedWall),
                Wall::Open => continue,
            };
            let name = format!("wall x{} {} ({kind})", axis + 1, ["low", "high"][side]);
            add(&name, role, &|s| {
                let mut sheet = shown(s);
                let at = [sheet.min[axis], sheet.max[axis]][side];
                (sheet.min[axis], sheet.max[axis]) = (at, at);
                (0..3).all(|a| a == axis || sheet.extent(a) > 0.0).then_some(sheet)
            });
        }
    }
}

/// The bodies of a case without conductors, and the labels of its steps: the layer, as far as the contact of
/// the closed form reaches if the layer has no ends.
fn layer_alone(case: &Case, steps: &[StepResult]) -> (Vec<SceneBody>, Vec<String>) {
    let Some(layer) = &case.layer else { return (Vec::new(), Vec::new()) };
    let (mut half_length, mut half_width) = (2.0 * layer.thickness, 2.0 * layer.thickness);
    if let Some(Mechanics::ClosedForm { contact_half_length, contact_width, .. }) = case.mechanics {
        (half_length, half_width) = (contact_half_length, 0.5 * contact_width);
    }
    half_length = layer.half_length.unwrap_or(half_length);
    let known: Vec<_> =
        steps.iter().filter_map(|s| Some((s, layer.thickness - s.row.top_displacement_m?))).collect();
    let poses = known
        .iter()
        .map(|(_, top)| Box3 { min: [-half_length, 0.0, -half_width], max: [half_length, *top, half_width] });
    let poses: Vec<_> = poses.collect();
    let labels: Vec<_> = known.iter().map(|(step, _)| label(step)).collect();
    if poses.is_empty() {
        return (Vec::new(), labels);
    }
    let mut bodies = vec![SceneBody { name: "layer".into(), role: BodyRole::Layer, poses }];
    let steps: Vec<&StepResult> = known.iter().map(|(step, _)| *step).collect();
    add_surroundings_of_layer(case, &steps, &mut bodies);
    bodies.extend(scale_bar(&bodies));
    (bodies, labels)
}

/// The bodies of all steps, for a viewer.
#[derive(Debug, Clone, PartialEq)]
pub enum Shown {
    /// Boxes with their poses, and the labels of the steps; without bodies where no step has a scene.
    Boxes(Vec<SceneBody>, Vec<String>),
    /// Each step's label and its bodies by their surfaces.
    Surfaces(Vec<(String, Vec<SurfaceBody>)>),
}

/// The bodies of all steps: as boxes if they are boxes at every step, otherwise as surfaces.
pub fn shown(case: &Case, steps: &[StepResult]) -> Shown {
    match surfaces(case, steps) {
        Some(surfaces) => Shown::Surfaces(surfaces),
        None => {
            let (bodies, labels) = bodies(case, steps);
            Shown::Boxes(bodies, labels)
        }
    }
}

/// The bodies of all steps by their surfaces; `None` if boxes describe those of every step.
pub fn surfaces(case: &Case, steps: &[StepResult]) -> Option<Vec<(String, Vec<SurfaceBody>)>> {
    let has_skin = |step: &StepResult| step.layer.as_ref().is_some_and(|layer| !layer.skin.layer.is_empty());
    if !steps.iter().any(|step| has_skin(step) || !step.surfaces.is_empty()) {
        return None;
    }
    let shown =
        steps.iter().filter(|step| has_skin(step) || step.scene.is_some() || !step.surfaces.is_empty());
    let mut states: Vec<(String, Vec<SurfaceBody>)> =
        shown.map(|step| (label(step), surfaces_of(case, step))).collect();
    let bodies = states.iter().flat_map(|(_, bodies)| bodies);
    let corners = bodies.flat_map(|body| body.triangles.as_flattened());
    let bounds = corners.map(|&p| Box3 { min: p, max: p }).reduce(|bounds, p| bounds.union(&p));
    if let Some((name, bar)) = bounds.and_then(|bounds| bar_before(&bounds)) {
        for (_, bodies) in &mut states {
            let (name, triangles) = (name.clone(), of_box(&bar));
            bodies.push(SurfaceBody { name, role: BodyRole::ScaleBar, triangles });
        }
    }
    Some(states)
}

/// The bodies of a step. The layer and the electrodes in it are shown with the surfaces of the finite-element
/// mesh, if there is one.
fn surfaces_of(case: &Case, step: &StepResult) -> Vec<SurfaceBody> {
    let mut bodies: Vec<SurfaceBody> = if step.surfaces.is_empty() {
        let (bodies, _) = bodies(case, std::slice::from_ref(step));
        // Bodies that surround all others are left out. The indenter, and the substrate of a layer of finite
        // elements, follow below.
        let shown = bodies.into_iter().filter(|body| match body.role {
            BodyRole::Cover
            | BodyRole::Wall
            | BodyRole::GroundedWall
            | BodyRole::Surroundings
            | BodyRole::Indenter
            | BodyRole::ScaleBar => false,
            BodyRole::Substrate => step.layer.is_none(),
            BodyRole::Conductor
            | BodyRole::FloatingConductor
            | BodyRole::GroundedConductor
            | BodyRole::Layer
            | BodyRole::Dielectric => true,
        });
        let surface = |body: SceneBody| SurfaceBody {
            triangles: body.poses.first().map(of_box).unwrap_or_default(),
            name: body.name,
            role: body.role,
        };
        shown.map(surface).collect()
    } else {
        step.surfaces.clone()
    };
    if let Some(skin) = step.layer.as_ref().map(|layer| &layer.skin) {
        // An electrode that is alone on its wire has the name of the terminal; electrodes that share a wire
        // are shown as boxes.
        let named = |name: &'static str| match case.terminals.iter().find(|terminal| terminal.holds(name)) {
            None => Some(name),
            Some(terminal) => (terminal.conductors.len() == 1).then_some(terminal.name.as_str()),
        };
        let names = case.electrodes.iter().flat_map(|electrodes| electrodes.names().map(named));
        let electrodes = names
            .zip(&skin.electrodes)
            .filter_map(|(name, triangles)| Some((name?, BodyRole::Conductor, triangles)));
        for (name, role, triangles) in electrodes.chain([("layer", BodyRole::Layer, &skin.layer)]) {
            let triangles = triangles.clone();
            match bodies.iter_mut().find(|body| body.name == name) {
                Some(body) => body.triangles = triangles,
                None => bodies.push(SurfaceBody { name: name.into(), role, triangles }),
            }
        }
    }
    let of_layer = bodies.iter().filter(|body| body.role == BodyRole::Layer);
    let corners = of_layer.flat_map(|body| body.triangles.as_flattened());
    let bounds = corners.map(|&p| Box3 { min: p, max: p }).reduce(|bounds, p| bounds.union(&p));
    if let (Some(layer), Some(bounds)) = (&case.layer, bounds) {
        // A substrate in the field is as large as the field, but is shown only under the layer.
        bodies.retain(|body| body.role != BodyRole::Substrate);
        let triangles = of_box(&slab(&bounds, layer.thickness));
        bodies.push(SurfaceBody { name: "substrate".into(), role: BodyRole::Substrate, triangles });
        let has_indenter = bodies.iter().any(|body| body.role == BodyRole::Indenter);
        if let (false, Some(triangles)) =
            (has_indenter, height(case, step).and_then(|height| indenter(case, height)))
        {
            bodies.push(SurfaceBody { name: "indenter".into(), role: BodyRole::Indenter, triangles });
        }
    }
    bodies
}

/// The load of a step in words.
pub(crate) fn label(step: &StepResult) -> String {
    if let Some(distance) = step.row.distance_m.filter(|distance| *distance > 0.0) {
        return format!("at a distance of {}", prefixed(distance, 3, "m"));
    }
    match (step.load, step.row.compression) {
        (StepLoad::None, _) => "unloaded".to_owned(),
        (StepLoad::Compression(c), _) => format!("U/H = {c}"),
        (StepLoad::ForceN(force), Some(c)) => format!("F = {force} N (U/H = {c:.4})"),
        (StepLoad::ForceN(force), None) => format!("F = {force} N"),
    }
}

fn intersection(a: &Box3, b: &Box3) -> Box3 {
    let pick = |x: [f64; 3], y: [f64; 3], choose: fn(f64, f64) -> f64| [0, 1, 2].map(|k| choose(x[k], y[k]));
    Box3 { min: pick(a.min, b.min, f64::max), max: pick(a.max, b.max, f64::min) }
}

/// The region with a margin on all sides.
fn grown(region: Box3) -> Box3 {
    let by = APART * (0..3).map(|a| region.extent(a)).fold(0.0, f64::max);
    Box3 { min: region.min.map(|x| x - by), max: region.max.map(|x| x + by) }
}

/// The region, if it has a volume.
fn solid(region: Box3) -> Option<Box3> {
    (0..3).all(|a| region.extent(a) > 0.0).then_some(region)
}

/// The names of the bodies by their ids in a field file: the surroundings, then dielectrics, then conductors.
fn body_names(scene: &Scene) -> Vec<String> {
    let dielectrics = scene.dielectrics().map(|d| d.body);
    let named = dielectrics.chain(scene.conductors().map(|c| c.body)).map(|body| body.name.clone());
    std::iter::once("surroundings".to_owned()).chain(named).collect()
}

/// The solver's field in the form that the exporter takes.
pub fn field_grid(scene: &Scene, field: Field) -> FieldGrid {
    let dielectrics = scene.dielectrics().count();
    // As in `body_names`: the background, the dielectrics, the conductors.
    let id = |body: CellBody| match body {
        CellBody::Background => 0,
        CellBody::Dielectric(index) => 1 + index,
        CellBody::Conductor(index) => 1 + dielectrics + index,
    };
    FieldGrid {
        axes: field.nodes,
        bent: field.points,
        potential: field.potential,
        electric_field: field.electric_field,
        relative_permittivity: field.relative_permittivity,
        body_id: field.body.into_iter().map(|body| id(body) as i32).collect(),
        body_names: body_names(scene),
    }
}

/// The scene on a graded grid like the solver's first one, without symmetry and without a field.
pub fn geometry_grid(scene: &Scene) -> FieldGrid {
    let resolution = Resolution { order: 4, levels: 2, ratio: 0.15, slope: 1.0, first: 1 };
    let axes = [0, 1, 2].map(|axis| {
        let (planes, ends) = planes(scene, axis);
        let mut nodes = graded_axis(&planes, ends, &resolution).line.nodes;
        nodes.sort_by(f64::total_cmp);
        nodes.dedup();
        nodes
    });
    let middle = |axis: usize, i: usize| 0.5 * (axes[axis][i] + axes[axis][i + 1]);
    let cells = axes.each_ref().map(|nodes| nodes.len().saturating_sub(1));
    let dielectrics = scene.dielectrics().count();
    let lookup = scene.lookup();
    let mut relative_permittivity = Vec::new();
    let mut body_id = Vec::new();
    for i in 0..cells[0] {
        for j in 0..cells[1] {
            for k in 0..cells[2] {
                let point = [middle(0, i), middle(1, j), middle(2, k)];
                let (id, permittivity) = match lookup.body_at(point) {
                    Filling::Background => (0, scene.background_permittivity),
                    Filling::Conductor(c) => (1 + dielectrics + c.index, 1.0),
                    Filling::Dielectric(d) => (1 + d.index, d.relative_permittivity),
                };
                body_id.push(id as i32);
                relative_permittivity.push(permittivity);
            }
        }
    }
    FieldGrid {
        potential: vec![0.0; axes.iter().map(Vec::len).product()],
        electric_field: vec![[[0.0; 3]; 2]; axes.iter().map(Vec::len).product()],
        relative_permittivity,
        body_id,
        body_names: body_names(scene),
        bent: None,
        axes,
    }
}

/// The planes of the scene across an axis, those of conductors marked, and the conditions at both ends of the
/// axis.
fn planes(scene: &Scene, axis: usize) -> (Vec<Plane>, [End; 2]) {
    let bounds = |region: Box3, edge: bool| {
        [region.min[axis], region.max[axis]]
            .map(|at| Plane { at, edge })
            .into_iter()
            .filter(|p| p.at.is_finite())
    };
    let metal = || scene.conductor_parts().filter_map(|(_, part)| part.as_box());
    let filled = scene.dielectric_parts().filter_map(|(_, part)| part.as_box());
    let conductors = metal().flat_map(|region| bounds(region, true));
    let others = filled.flat_map(|region| bounds(region, false));
    let mut planes: Vec<Plane> = conductors.chain(others).chain(bounds(scene.domain, false)).collect();
    planes.sort_by(|a, b| a.at.total_cmp(&b.at));
    let mut distinct: Vec<Plane> = Vec::with_capacity(planes.len());
    for plane in planes {
        match distinct.last_mut() {
            Some(last) if last.at == plane.at => last.edge |= plane.edge,
            _ => distinct.push(plane),
        }
    }
    let bounds = metal().reduce(|a, b| a.union(&b));
    let bounds = bounds.unwrap_or(Box3 { min: [0.0; 3], max: [1.0; 3] });
    let reach = (0..3).map(|a| bounds.extent(a)).fold(0.0, f64::max);
    let pole = 0.5 * (bounds.min[axis] + bounds.max[axis]);
    let end = |side: usize| match scene.walls[axis][side] {
        Wall::Open => End::Open { pole, reach, radius: reach },
        Wall::Insulated | Wall::Grounded => End::Closed,
    };
    (distinct, [end(0), end(1)])
}
