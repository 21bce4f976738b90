//! Reads a scene from a volume mesh, whose physical groups are the bodies.

use std::ops::Range;
use std::path::Path;

use elastocap_geometry::import::ImportProblem;
use elastocap_geometry::import::gmsh::{VolumeMesh, mesh_from_path};
use elastocap_geometry::import::obj::Placement;
use elastocap_geometry::meshing::tets::{FaceRole, TetMesh};

use super::super::diagnostics::{Diagnostic, shown, shown_path};
use elastocap_geometry::scene::{Potential, Scene};

use super::super::model::{Body, Box3, Extent, ImportedMesh, Shape, Surroundings, Terminal};
use super::super::raw::{self, Document};
use super::super::reader::{Log, Read, nearest};
use super::super::values::Text;
use super::bodies::{check_count, check_names, conductor_of};
use super::given;
use super::shapes::{Located, check_one_is_driven};

/// The bodies of a mesh.
pub(super) struct Imported {
    /// The bodies as groups of the mesh.
    pub bodies: Vec<Body>,
    /// The mesh with its roles.
    pub mesh: ImportedMesh,
    /// The bodies by their shapes, if these are simple enough for other solvers.
    pub shapes: Option<Shapes>,
}

/// The bodies of a mesh by their shapes.
pub(super) struct Shapes {
    pub bodies: Vec<Body>,
    /// The extent of the field.
    pub extent: Extent,
}

/// The largest number of names of groups in one message.
const MAX_NAMES: usize = 20;

/// The form of a body: its key and its place in the file.
type Form<'a> = (&'static str, &'a Range<usize>);

/// Whether the case has a mesh, or a body that needs one.
pub(super) fn any_physical(raw: &Document) -> bool {
    raw.mesh.is_some()
        || conductors(raw).iter().filter_map(Read::get).any(|c| c.physical.is_some())
        || dielectrics(raw).iter().filter_map(Read::get).any(|d| d.physical.is_some())
}

/// The conductors of the file.
fn conductors(raw: &Document) -> &[Read<raw::Conductor>] {
    given(&raw.conductor).map_or(&[], Vec::as_slice)
}

/// The dielectrics of the file.
fn dielectrics(raw: &Document) -> &[Read<raw::Dielectric>] {
    given(&raw.dielectric).map_or(&[], Vec::as_slice)
}

/// The bodies and the mesh with its roles; `None` if a part is invalid, with the reason in the log.
///
/// `flawed` says that an unknown key at the top level may stand for [mesh].
pub(super) fn bodies(
    raw: &Document,
    flawed: bool,
    surroundings: Option<&Surroundings>,
    terminals: &[Terminal],
    origin: &Path,
    log: &mut Log<'_>,
) -> Option<Imported> {
    if !check_count(conductors(raw).len(), dielectrics(raw).len(), log) {
        return None;
    }
    check_names(raw, conductors(raw), dielectrics(raw), None, log);
    let Some(table) = &raw.mesh else {
        if !flawed {
            lacks_mesh(raw, log);
        }
        return None;
    };
    if !no_layer(raw, table, log) || !all_physical(raw, table, log) {
        return None;
    }
    let file = &table.get()?.file;
    let mesh = read(table.get()?, origin, log)?;
    let placed: Vec<_> = conductors(raw).iter().map(|c| conductor(c.get()?, &mesh, log)).collect();
    let filled: Vec<_> = dielectrics(raw).iter().map(|d| dielectric(d.get()?, &mesh, log)).collect();
    let placed: Vec<Located> = placed.into_iter().collect::<Option<_>>()?;
    let filled: Vec<Body> = filled.into_iter().collect::<Option<_>>()?;
    check_one_each(&placed, log);
    check_one_is_driven(&placed, log);
    let surroundings = surroundings?;
    if !log.is_empty() || placed.is_empty() {
        return None;
    }
    let unnamed = unnamed(&mesh, &placed, &filled);
    let spans: Vec<(String, Range<usize>)> = placed
        .iter()
        .map(|(body, span)| {
            let terminal = terminals.iter().find(|terminal| terminal.holds(&body.name));
            (terminal.map_or(&body.name, |terminal| &terminal.name).clone(), span.clone())
        })
        .collect();
    let bodies: Vec<Body> = placed.into_iter().map(|(body, _)| body).chain(filled).collect();
    // The faces are numbered in the order that the solvers use.
    let scene = Scene {
        bodies: Terminal::join(terminals, bodies.clone()),
        background_permittivity: surroundings.relative_permittivity,
        domain: Box3::SPACE,
        walls: [[surroundings.boundary; 2]; 3],
    };
    let tets = tets_of(&mesh, &scene, &spans, &file.span, log)?;
    if !flux_has_an_end(&tets, &scene, &spans, log) {
        return None;
    }
    let file = file.get()?.0.clone();
    let scene = Scene { bodies, ..scene };
    let shapes = mesh.bodies(&scene).map(|(bodies, domain)| Shapes {
        bodies,
        extent: if domain == Box3::SPACE { Extent::Everywhere } else { Extent::Walls(domain) },
    });
    Some(Imported { bodies: scene.bodies, mesh: ImportedMesh { file, tets, unnamed }, shapes })
}

/// Refuses a layer beside the mesh; true if there is none.
fn no_layer(raw: &Document, table: &Read<raw::MeshFile>, log: &mut Log<'_>) -> bool {
    if raw.layer.is_some() {
        log.push(
            Diagnostic::at(&table.span, "[mesh] beside [layer]: a mesh is the whole scene, and nothing presses it")
                .label("cannot be used in this case")
                .help("leave [layer], [electrodes], [mechanics] and [load] out and make the layer a volume of the mesh"),
        );
    }
    raw.layer.is_none()
}

/// The mesh with its roles; `spans` are the places in the case file where conductors are named, and `file` is
/// that of the mesh's file name.
fn tets_of(
    mesh: &VolumeMesh,
    scene: &Scene,
    spans: &[(String, Range<usize>)],
    file: &Range<usize>,
    log: &mut Log<'_>,
) -> Option<TetMesh> {
    let error = match mesh.tet_mesh(scene) {
        Ok(tets) => return Some(tets),
        Err(error) => error,
    };
    let blamed = match &error.problem {
        ImportProblem::Touching { second: name, .. }
        | ImportProblem::TouchingWall { name, .. }
        | ImportProblem::EndsAtOpenSpace { name, .. } => {
            spans.iter().find(|(conductor, _)| conductor == name)
        }
        _ => None,
    };
    let span = blamed.map_or(file, |(_, span)| span);
    log.push(Diagnostic::at(span, format!("the mesh cannot be used: {}", error.problem)));
    None
}

/// Refuses a single driven conductor in a mesh whose outer faces are all insulated; false if it is one.
fn flux_has_an_end(
    tets: &TetMesh,
    scene: &Scene,
    spans: &[(String, Range<usize>)],
    log: &mut Log<'_>,
) -> bool {
    let at_boundary = tets.boundary.iter().any(|f| !matches!(f.role, FaceRole::Conductor(_)));
    let has_end = at_boundary || scene.conductors().any(|c| c.potential == Potential::Grounded);
    let mut driven = scene.conductors().filter(|c| c.potential == Potential::Driven);
    let ((Some(only), None), false) = ((driven.next(), driven.next()), has_end) else { return true };
    let named = spans.iter().find(|(name, _)| *name == only.body.name);
    let span = named.map(|(_, span)| span.clone()).unwrap_or_default();
    log.push(
        Diagnostic::at(
            &span,
            format!(
                "the conductor \"{}\" is alone inside insulated walls: its capacitance is zero",
                shown(&only.body.name)
            ),
        )
        .label("its flux can end nowhere")
        .help("set `boundary` in [surroundings] to \"open\" or \"grounded\", or add another conductor"),
    );
    false
}

/// Reports the first body that is a group of a mesh when the case has no mesh.
fn lacks_mesh(raw: &Document, log: &mut Log<'_>) {
    let of_conductors = conductors(raw).iter().filter_map(|c| c.get()?.physical.as_ref());
    let of_dielectrics = dielectrics(raw).iter().filter_map(|d| d.get()?.physical.as_ref());
    if let Some(first) = of_conductors.chain(of_dielectrics).min_by_key(|read| read.span.start) {
        log.push(
            Diagnostic::at(&first.span, "`physical` names a group of a mesh, and this case has no [mesh]")
                .label("a group of what?")
                .help("add `[mesh]` with for example `file = \"sensor.msh\"` and `unit = \"mm\"`"),
        );
    }
}

/// Refuses bodies of another form than `physical`; true if there are none.
fn all_physical(raw: &Document, table: &Read<raw::MeshFile>, log: &mut Log<'_>) -> bool {
    let forms = conductors(raw).iter().filter_map(|c| {
        let conductor = c.get()?;
        let (key, span) = form_of_conductor(conductor)?;
        // Conductors from [electrodes] all have the place of that table.
        Some((if conductor.name.span == *span { "[electrodes]" } else { key }, span))
    });
    let forms = forms.chain(dielectrics(raw).iter().filter_map(|d| form_of_dielectric(d.get()?)));
    let others: Vec<Form<'_>> = forms.filter(|(key, _)| *key != "physical").collect();
    for (key, span) in &others {
        let key = if key.starts_with('[') { (*key).to_owned() } else { format!("`{key}`") };
        log.push(
            Diagnostic::at(
                span,
                format!("{key} beside [mesh]: a mesh is the whole scene, no body can be added to it"),
            )
            .label("not a part of the mesh")
            .related(&table.span, "the mesh")
            .help(
                "draw the body in Gmsh, name it with Physical Volume or Physical Surface and write a [[conductor]] or [[dielectric]] with \
                 `physical = \"its name\"`; or leave [mesh] out and give every body a shape",
            ),
        );
    }
    others.is_empty()
}

/// The form of a conductor: `physical` if it is given, since a second form beside it is reported elsewhere.
fn form_of_conductor(body: &raw::Conductor) -> Option<Form<'_>> {
    let raw::Conductor {
        r#box,
        boxes,
        sheet,
        sphere,
        capsule,
        shell,
        cylinder,
        extrusion,
        surface,
        physical,
        ..
    } = body;
    span("physical", physical)
        .or_else(|| span("box", r#box))
        .or_else(|| span("boxes", boxes))
        .or_else(|| span("sheet", sheet))
        .or_else(|| span("sphere", sphere))
        .or_else(|| span("capsule", capsule))
        .or_else(|| span("shell", shell))
        .or_else(|| span("cylinder", cylinder))
        .or_else(|| span("extrusion", extrusion))
        .or_else(|| span("surface", surface))
}

/// The form of a dielectric, as for a conductor.
fn form_of_dielectric(body: &raw::Dielectric) -> Option<Form<'_>> {
    let raw::Dielectric { r#box, slab, sphere, capsule, cylinder, extrusion, surface, physical, .. } = body;
    span("physical", physical)
        .or_else(|| span("box", r#box))
        .or_else(|| span("slab", slab))
        .or_else(|| span("sphere", sphere))
        .or_else(|| span("capsule", capsule))
        .or_else(|| span("cylinder", cylinder))
        .or_else(|| span("extrusion", extrusion))
        .or_else(|| span("surface", surface))
}

/// The form of this key, if it is given.
fn span<'a, T>(key: &'static str, read: &'a Option<Read<T>>) -> Option<Form<'a>> {
    read.as_ref().map(|read| (key, &read.span))
}

/// The mesh in the file; `None` if it cannot be used, with the reason in the log.
fn read(table: &raw::MeshFile, origin: &Path, log: &mut Log<'_>) -> Option<VolumeMesh> {
    let path = origin.parent().unwrap_or(Path::new("")).join(&table.file.get()?.0);
    let placement = Placement { unit: table.unit.get()?.si, translate: [0.0; 3] };
    match mesh_from_path(&path, placement) {
        Ok((mesh, _)) => Some(mesh),
        Err(error) => {
            log.push(
                Diagnostic::at(&table.file.span, format!("the mesh cannot be used: {}", error.problem))
                    .label(format!("read from {}", shown_path(&path)))
                    .help("a mesh is a .msh file of Gmsh, of version 4.1 or 2.2; its path is relative to the case file"),
            );
            None
        }
    }
}

/// The conductor in a group of the mesh; `None` if it is invalid, with the reason in the log.
fn conductor(body: &raw::Conductor, mesh: &VolumeMesh, log: &mut Log<'_>) -> Option<Located> {
    let read = body.physical.as_ref()?;
    let shape = group(read, 2, mesh, log)?;
    Some((conductor_of(body, vec![shape])?, read.span.clone()))
}

/// The dielectric in a group of the mesh; `None` if it is invalid, with the reason in the log.
fn dielectric(body: &raw::Dielectric, mesh: &VolumeMesh, log: &mut Log<'_>) -> Option<Body> {
    let shape = group(body.physical.as_ref()?, 3, mesh, log)?;
    let relative_permittivity = body.relative_permittivity.get()?.value;
    Some(Body::dielectric(&body.name.get()?.0, shape, relative_permittivity))
}

/// The group of that name, of volumes, or of surfaces too if `least` is 2; it must be there and not empty.
fn group(read: &Read<Text>, least: u8, mesh: &VolumeMesh, log: &mut Log<'_>) -> Option<Shape> {
    let name = &read.get()?.0;
    let wanted = if least == 2 { "of volumes or surfaces" } else { "of volumes" };
    let usable = || mesh.groups.iter().filter(|g| g.dimension >= least).map(|g| g.name.as_str());
    if usable().any(|known| known == name) {
        if size(mesh, name, least) > 0 {
            return Some(Shape::Physical(name.clone()));
        }
        log.push(
            Diagnostic::at(
                &read.span,
                format!("the physical group \"{}\" of the mesh is empty", shown(name)),
            )
            .label(format!("no elements {wanted} in it"))
            .help("mesh the geometry in three dimensions after its groups are named, and save it again"),
        );
        return None;
    }
    let mut known: Vec<_> = usable().take(MAX_NAMES + 1).map(|name| format!("\"{}\"", shown(name))).collect();
    if known.len() > MAX_NAMES {
        known[MAX_NAMES] = "...".to_owned();
    }
    let known =
        if known.is_empty() { "it has none".to_owned() } else { format!("it has {}", known.join(", ")) };
    let help = if mesh.groups.iter().any(|g| g.name == *name) {
        format!("\"{}\" is a group of surfaces, and a dielectric fills volumes; {known}", shown(name))
    } else if let Some(near) = nearest(name, usable()) {
        format!("write `physical = \"{}\"`; {known}", shown(near))
    } else if usable().next().is_none() {
        "name the bodies in Gmsh with Physical Volume or Physical Surface, and save the mesh again".to_owned()
    } else {
        known
    };
    log.push(
        Diagnostic::at(&read.span, format!("the mesh has no physical group \"{}\" {wanted}", shown(name)))
            .label("not a group of the mesh")
            .help(help),
    );
    None
}

/// The number of elements in the groups of this name.
fn size(mesh: &VolumeMesh, name: &str, least: u8) -> usize {
    let is_named = |group: u32| {
        let group = (group as usize).checked_sub(1).and_then(|k| mesh.groups.get(k));
        group.is_some_and(|g| g.name == name && g.dimension >= least)
    };
    mesh.tet_groups.iter().chain(&mesh.face_groups).filter(|&&g| is_named(g)).count()
}

/// Refuses two conductors of the same group.
fn check_one_each(placed: &[Located], log: &mut Log<'_>) {
    for (k, (second, span)) in placed.iter().enumerate() {
        if let Some((first, before)) = placed[..k].iter().find(|(first, _)| first.parts == second.parts) {
            log.push(
                Diagnostic::at(
                    span,
                    format!(
                        "\"{}\" and \"{}\" are the same physical group",
                        shown(&first.name),
                        shown(&second.name)
                    ),
                )
                .label("used again")
                .related(before, "first used here")
                .help("give each conductor a group of its own"),
            );
        }
    }
}

/// Groups of volumes that no body names.
fn unnamed(mesh: &VolumeMesh, placed: &[Located], filled: &[Body]) -> Vec<String> {
    let used = |name: &str| {
        let bodies = placed.iter().map(|(body, _)| body).chain(filled);
        bodies.flat_map(|body| &body.parts).any(|shape| matches!(shape, Shape::Physical(n) if n == name))
    };
    let volumes = mesh.groups.iter().filter(|g| g.dimension == 3 && !used(&g.name));
    volumes.map(|g| g.name.clone()).filter(|name| size(mesh, name, 3) > 0).collect()
}
