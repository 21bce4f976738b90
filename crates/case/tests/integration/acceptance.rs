//! Checks that the supported acceptance files give the expected cases.

use std::path::{Path, PathBuf};

use elastocap_case::{
    self, Body, Box3, Case, Electrodes, Electrostatics, Extent, Face, HyperelasticLaw, Indenter, Layer,
    LayerEnd, Layout, Load, Mechanics, Shape, ShearLength, Stiffness, Surroundings, Wall,
};

fn acceptance(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/acceptance").join(name)
}

fn load(name: &str) -> Case {
    elastocap_case::load(&acceptance(name)).unwrap_or_else(|e| panic!("{e}"))
}

fn in_plane_pair() -> Case {
    Case {
        title: "In-plane electrode pair, 50 um gap, 450 um layer".to_owned(),
        source: acceptance("in-plane-pair.toml"),
        layer: Some(Layer {
            thickness: 450e-6,
            half_length: None,
            relative_permittivity: Some(2.8),
            foam: None,
            stress_table: None,
            material: Some(HyperelasticLaw::MooneyRivlin { c10: 682.15, c01: 43931.9 }),
            bulk_modulus: None,
        }),
        electrodes: Some(Electrodes {
            layout: Layout::InPlane,
            gap: 50e-6,
            length: 300e-6,
            thickness: 20e-6,
            width: 500e-6,
            height: 225e-6,
            stiffness: Stiffness::ShearModulus(1e6),
        }),
        mechanics: Some(Mechanics::ClosedForm {
            contact_half_length: 500e-6,
            contact_width: 500e-6,
            shear_length: ShearLength::Given(500e-6),
        }),
        load: Some(Load::Compression(vec![0.0, 0.05, 0.1, 0.2, 0.3, 0.4])),
        poses: Vec::new(),
        indenter: None,
        bodies: vec![],
        terminals: Vec::new(),
        measured: None,
        recognised: Vec::new(),
        mesh: None,
        surroundings: Some(Surroundings {
            boundary: Wall::Insulated,
            relative_permittivity: 1.0,
            extent: Extent::AroundLayer {
                side_margin: Some(1e-3),
                below: Face::Insulated,
                above: Face::Medium {
                    relative_permittivity: 1.0,
                    thickness: Some(1e-3),
                    then: Wall::Insulated,
                },
            },
        }),
        electrostatics: Some(Electrostatics {
            relative_tolerance: 1e-3,
            absolute_tolerance: None,
            change_tolerance: None,
            bounds: true,
            solver: None,
            order: None,
        }),
        mechanics_chosen: None,
        measured_points: None,
    }
}

#[test]
fn the_in_plane_pair_is_read_whole() {
    assert_eq!(load("in-plane-pair.toml"), in_plane_pair());
    assert_eq!(load("in-plane-pair.toml").file_name(), "in-plane-pair.toml");
}

#[test]
fn the_same_pair_by_force_differs_in_the_load_only() {
    let expected = Case {
        title: "In-plane pair pressed to given forces".to_owned(),
        source: acceptance("in-plane-pair-by-force.toml"),
        load: Some(Load::Force(vec![0.0, 0.01, 0.05, 0.1, 0.3])),
        ..in_plane_pair()
    };
    assert_eq!(load("in-plane-pair-by-force.toml"), expected);
}

#[test]
fn the_stacked_pair_is_read_with_its_range_of_steps_and_open_space() {
    let case = load("stacked-pair.toml");
    let layer = case.layer.unwrap();
    assert_eq!(layer.material, Some(HyperelasticLaw::NeoHookean { shear_modulus: 1e5 }));
    let electrodes = case.electrodes.unwrap();
    assert_eq!((electrodes.layout, electrodes.stiffness), (Layout::Stacked, Stiffness::Rigid));
    let steps = vec![0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4];
    assert_eq!(case.load, Some(Load::Compression(steps)));
    let surroundings = case.surroundings.unwrap();
    assert_eq!(surroundings.boundary, Wall::Open);
    assert_eq!(
        surroundings.extent,
        Extent::AroundLayer {
            side_margin: None,
            below: Face::Medium { relative_permittivity: 4.5, thickness: Some(1.6e-3), then: Wall::Open },
            above: Face::Medium { relative_permittivity: 1.0, thickness: None, then: Wall::Open },
        }
    );
}

#[test]
fn purely_electrostatic_scenes_have_no_layer_and_no_load() {
    let cube = |name: &str, half: bool| {
        let [min, max] = if half { [[-0.5; 3], [0.5; 3]] } else { [[0.0; 3], [1.0; 3]] };
        Body::conductor(name, Shape::Box(Box3 { min, max }))
    };
    let isolated = load("isolated-cube.toml");
    assert_eq!(isolated.bodies, [cube("cube", false)]);
    assert_eq!(isolated.surroundings.as_ref().map(|s| &s.extent), Some(&Extent::Everywhere));
    assert_eq!(isolated.electrostatics.map(|e| e.relative_tolerance), Some(1e-4));
    assert_eq!((isolated.layer, isolated.load, isolated.mechanics), (None, None, None));

    let nested = load("cube-in-cube.toml");
    assert_eq!(nested.bodies, [cube("inner", true)]);
    let walls = Box3 { min: [-1.0; 3], max: [1.0; 3] };
    assert_eq!(
        nested.surroundings.map(|s| (s.boundary, s.extent)),
        Some((Wall::Grounded, Extent::Walls(walls)))
    );

    let plates = load("square-plates.toml");
    let sheets: Vec<Box3> = plates.bodies.iter().flat_map(|body| body.boxes().unwrap()).collect();
    let normals: Vec<_> = sheets.iter().map(Box3::sheet_normal).collect();
    assert_eq!(normals, [Some(1), Some(1)]);
    assert_eq!(sheets[1], Box3 { min: [0.0, 0.1, 0.0], max: [1.0, 0.1, 1.0] });
}

#[test]
fn the_finite_element_layers_are_read() {
    let model = |name: &str| match load(name).mechanics {
        Some(Mechanics::PlaneStrain(model)) => model,
        other => panic!("{name}: {other:?}"),
    };
    let free = model("layer-free-end.toml");
    assert_eq!((free.indenter, free.end), (Indenter::WholeTop, LayerEnd::Free));
    assert_eq!((free.width, free.relative_tolerance), (1e-3, 5e-3));
    assert_eq!(model("layer-on-substrate.toml").end, LayerEnd::FreeOnSubstrate);
    let Indenter::FlatPunch { half_width, contact, position } = model("flat-punch.toml").indenter else {
        panic!("no flat punch")
    };
    assert!((half_width - 500e-6).abs() < 1e-18 && (contact.corner_radius().unwrap() - 9e-6).abs() < 1e-18);
    assert_eq!(position, 0.0);
    assert!(load("flat-punch.toml").electrodes.is_some());
}

#[test]
fn bodies_of_other_shapes_are_read_as_they_are() {
    let shapes = |name: &str| {
        let case = load(name);
        assert!(!case.has_only_boxes(), "{name} has boxes only");
        case.bodies.into_iter().flat_map(|body| body.parts).collect::<Vec<Shape>>()
    };
    let spheres = shapes("two-spheres.toml");
    let radii = spheres.iter().map(|shape| match *shape {
        Shape::Sphere { radius, .. } => radius,
        _ => panic!("{shape:?}"),
    });
    assert_eq!(radii.collect::<Vec<_>>(), [0.01, 0.02]);
    let layered = shapes("layered-spheres.toml");
    assert!(layered.iter().any(|shape| matches!(shape, Shape::Shell { .. })));
    assert!(matches!(layered.last(), Some(Shape::Sphere { .. })), "dielectrics come last");
    let pattern = shapes("rounded-pattern.toml");
    let Shape::Extrusion { axis, from, to, outline, .. } = &pattern[0] else { panic!("no extrusion") };
    assert_eq!((*axis, *from, outline.len()), (1, 0.0, 6));
    assert!((to - 10e-6).abs() < 1e-18);
    assert!(matches!(pattern[1], Shape::Cylinder { axis: 1, .. }));
}

#[test]
fn electrode_regions_lie_around_the_origin_at_their_height() {
    let pair = in_plane_pair().electrodes.unwrap();
    let close = |found: Box3, min: [f64; 3], max: [f64; 3]| {
        for a in 0..3 {
            assert!(
                (found.min[a] - min[a]).abs() < 1e-18 && (found.max[a] - max[a]).abs() < 1e-18,
                "{found:?}"
            );
        }
    };
    let [left, right] = pair.regions();
    close(left, [-325e-6, 215e-6, -250e-6], [-25e-6, 235e-6, 250e-6]);
    close(right, [25e-6, 215e-6, -250e-6], [325e-6, 235e-6, 250e-6]);
    let [lower, upper] = load("stacked-pair.toml").electrodes.unwrap().regions();
    close(lower, [-500e-6, 115e-6, -500e-6], [500e-6, 125e-6, 500e-6]);
    close(upper, [-500e-6, 325e-6, -500e-6], [500e-6, 335e-6, 500e-6]);
}
