//! Where the bodies are after loading, and when they do not fit.

use elastocap_case::{
    Body, Box3, Case, Electrodes, Electrostatics, Extent, Face, HyperelasticLaw, Layer, Layout, Mechanics,
    Pose, Shape, ShearLength, Stiffness, Surroundings, Wall,
};
use elastocap_coupling::deform::Deformation;
use elastocap_coupling::scene::{DeformedScene, SceneError, scene_of};
use elastocap_electrostatics::VACUUM_PERMITTIVITY;
use elastocap_geometry::scene::Scene;
use elastocap_mechanics::{ClosedFormSettings, LayerState, MooneyRivlin};

/// The pair of the paper.
fn pair(layout: Layout) -> Case {
    Case {
        title: "pair".into(),
        source: "pair.toml".into(),
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
            layout,
            gap: 50e-6,
            length: 300e-6,
            thickness: 20e-6,
            width: 500e-6,
            height: 225e-6,
            stiffness: Stiffness::ShearModulus(1e6),
        }),
        mechanics_chosen: None,
        mechanics: Some(Mechanics::ClosedForm {
            contact_half_length: 500e-6,
            contact_width: 500e-6,
            shear_length: ShearLength::Given(500e-6),
        }),
        load: None,
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
        measured_points: None,
    }
}

fn open(mut case: Case) -> Case {
    let surroundings = case.surroundings.as_mut().unwrap();
    surroundings.boundary = Wall::Open;
    surroundings.extent = Extent::AroundLayer {
        side_margin: None,
        below: Face::Medium { relative_permittivity: 4.5, thickness: Some(1.6e-3), then: Wall::Open },
        above: Face::Medium { relative_permittivity: 1.0, thickness: None, then: Wall::Open },
    };
    case
}

fn pressed(compression: f64) -> Deformation<'static> {
    let rubber = MooneyRivlin { c10: 682.15, c01: 43931.9 };
    let lengths =
        ClosedFormSettings { contact_half_length: 500e-6, contact_width: 500e-6, shear_length: 500e-6 };
    Deformation::ClosedForm(LayerState::new(450e-6, rubber, compression, lengths).unwrap())
}

/// The boxes of the electrodes, which come first.
fn electrodes(deformed: &DeformedScene) -> [Box3; 2] {
    let boxes = |body: &Body| body.boxes().unwrap();
    deformed.scene.bodies[..2].iter().flat_map(boxes).collect::<Vec<_>>().try_into().unwrap()
}

/// The boxes of the layer, the substrate and the cover.
fn slabs(scene: &Scene) -> Vec<Box3> {
    scene.dielectrics().map(|d| d.body.bounds().unwrap()).collect()
}

fn at(case: &Case, compression: f64) -> Result<DeformedScene, SceneError> {
    scene_of(case, Some(&pressed(compression)), &Pose::default())
}

#[track_caller]
fn assert_close(found: f64, wanted: f64) {
    assert!((found - wanted).abs() <= 1e-9 * wanted.abs(), "{found:e} instead of {wanted:e}");
}

#[test]
fn the_in_plane_pair_moves_and_thins_as_the_audit_says() {
    let case = pair(Layout::InPlane);
    for (compression, gap, height, thickness) in [
        (0.05, 52.989_560_76e-6, 217.847_304_2e-6, 19.896_405e-6),
        (0.2, 64.701_206_34e-6, 194.785_371_1e-6, 19.525_280_34e-6),
        (0.4, 91.785_151_8e-6, 159.477_312_6e-6, 18.678_900_49e-6),
    ] {
        let deformed = at(&case, compression).unwrap();
        let found = deformed.pair.unwrap();
        assert_close(found.gap, gap);
        assert_close(found.height, height);
        assert!((found.thickness / thickness - 1.0).abs() < 1e-7);
        let [left, right] = electrodes(&deformed);
        assert_eq!(left.max[0], -right.min[0], "mirror images, exactly");
        assert_eq!(left.min[0], -right.max[0]);
        assert_close(right.extent(0) * right.extent(1), 300e-6 * 20e-6);
        // The walls follow.
        assert_close(deformed.scene.domain.max[0], right.max[0] + 1e-3);
        assert_close(deformed.scene.domain.max[1], 450e-6 * (1.0 - compression) + 1e-3);
        assert_eq!(deformed.scene.domain.min[1], 0.0);
    }
}

#[test]
fn without_load_the_bodies_are_where_the_file_says() {
    for layout in [Layout::InPlane, Layout::Stacked] {
        let case = pair(layout);
        let given = case.electrodes.as_ref().unwrap();
        for deformed in [scene_of(&case, None, &Pose::default()).unwrap(), at(&case, 0.0).unwrap()] {
            for (region, wanted) in electrodes(&deformed).into_iter().zip(given.regions()) {
                for a in 0..3 {
                    assert!((region.min[a] - wanted.min[a]).abs() < 1e-18);
                    assert!((region.max[a] - wanted.max[a]).abs() < 1e-18);
                }
            }
            assert_close(deformed.pair.unwrap().gap, 50e-6);
            assert_close(deformed.pair.unwrap().height, 225e-6);
        }
    }
}

#[test]
fn a_stacked_pair_is_the_parallel_plate_capacitor_of_its_facing_area() {
    let deformed = at(&pair(Layout::Stacked), 0.3).unwrap();
    let found = deformed.pair.unwrap();
    let [lower, upper] = electrodes(&deformed);
    assert_close(found.gap, upper.min[1] - lower.max[1]);
    let facing = lower.extent(0).min(upper.extent(0)) * 500e-6;
    assert_close(found.parallel_plate, VACUUM_PERMITTIVITY * 2.8 * facing / found.gap);
    assert!(found.gap < 50e-6);
}

#[test]
fn a_rigid_pair_whose_gap_closes_has_no_scene() {
    let mut case = pair(Layout::Stacked);
    let electrodes = case.electrodes.as_mut().unwrap();
    (electrodes.thickness, electrodes.stiffness) = (100e-6, Stiffness::Rigid);
    let gap = at(&case, 0.1).unwrap().pair.unwrap().gap;
    assert!(0.0 < gap && gap < 50e-6, "{gap:e}");
    let error = at(&case, 0.5).unwrap_err();
    assert!(matches!(error, SceneError::GapCloses { gap } if gap < 0.0), "{error}");
}

#[test]
fn a_rigid_electrode_that_the_crushed_layer_cannot_hold_has_no_scene() {
    let mut case = pair(Layout::InPlane);
    let electrodes = case.electrodes.as_mut().unwrap();
    (electrodes.thickness, electrodes.stiffness) = (200e-6, Stiffness::Rigid);
    let error = at(&case, 0.7).unwrap_err();
    assert!(matches!(error, SceneError::LeavesLayer { .. }), "{error}");
}

#[test]
fn an_electrode_on_the_layers_surface_stays_on_it() {
    for stiffness in [Stiffness::Rigid, Stiffness::ShearModulus(1e6), Stiffness::ShearModulus(89228.1)] {
        for (height, top) in [(440e-6, true), (10e-6, false)] {
            let mut case = pair(Layout::InPlane);
            let given = case.electrodes.as_mut().unwrap();
            (given.height, given.stiffness) = (height, stiffness);
            for compression in [0.0, 1e-12, 1e-3, 0.2, 0.6] {
                let deformed = at(&case, compression).unwrap();
                let [region, _] = electrodes(&deformed);
                let surface = slabs(&deformed.scene)[0];
                if top {
                    assert_eq!(region.max[1], surface.max[1], "{stiffness:?} {compression}");
                } else {
                    assert_eq!(region.min[1], 0.0, "{stiffness:?} {compression}");
                }
                assert_close(deformed.pair.unwrap().height, 0.5 * (region.min[1] + region.max[1]));
            }
        }
    }
}

#[test]
fn open_space_has_walls_only_where_the_case_says_so() {
    let case = open(pair(Layout::Stacked));
    let scene = at(&case, 0.1).unwrap().scene;
    assert_eq!(scene.walls, [[Wall::Open; 2]; 3]);
    assert_eq!(scene.domain, Box3::SPACE);
    let bounds: Vec<_> = slabs(&scene).iter().map(|slab| (slab.min[1], slab.max[1])).collect();
    let top = 450e-6 * 0.9;
    assert_eq!(bounds, [(0.0, top), (-1.6e-3, 0.0), (top, f64::INFINITY)]);

    let mut half = case;
    if let Extent::AroundLayer { below, .. } = &mut half.surroundings.as_mut().unwrap().extent {
        *below = Face::Grounded;
    }
    let scene = at(&half, 0.1).unwrap().scene;
    assert_eq!(scene.walls[1], [Wall::Grounded, Wall::Open]);
    assert_eq!((scene.domain.min[1], scene.domain.max[1]), (0.0, f64::INFINITY));

    // A cover of a thickness lies on the layer's top and goes down with it.
    if let Extent::AroundLayer { above, .. } = &mut half.surroundings.as_mut().unwrap().extent {
        *above = Face::Medium { relative_permittivity: 3.0, thickness: Some(100e-6), then: Wall::Insulated };
    }
    let scene = at(&half, 0.1).unwrap().scene;
    let cover = slabs(&scene).pop().unwrap();
    assert_eq!(cover.min[1], top);
    assert_close(cover.max[1], top + 100e-6);
}

#[test]
fn a_wall_that_comes_down_on_a_conductor_leaves_no_scene() {
    let mut case = pair(Layout::InPlane);
    let region = Box3 { min: [-1e-4, 1.3e-3, -1e-4], max: [1e-4, 1.4e-3, 1e-4] };
    case.bodies.push(Body::conductor("finger", Shape::Box(region)));
    assert_eq!(at(&case, 0.0).unwrap().scene.conductors().nth(2).unwrap().body.bounds(), Some(region));
    let error = at(&case, 0.5).unwrap_err();
    assert!(
        matches!(&error, SceneError::ReachesWall { conductor, side: "above" } if conductor == "finger"),
        "{error}"
    );
}

#[test]
fn every_slab_has_its_own_permittivity_and_the_rest_that_of_the_surroundings() {
    let mut case = open(pair(Layout::InPlane));
    let surroundings = case.surroundings.as_mut().unwrap();
    surroundings.relative_permittivity = 1.5;
    surroundings.extent = Extent::AroundLayer {
        side_margin: None,
        below: Face::Medium { relative_permittivity: 4.5, thickness: Some(1.6e-3), then: Wall::Open },
        above: Face::Medium { relative_permittivity: 3.25, thickness: Some(1e-4), then: Wall::Open },
    };
    let scene = at(&case, 0.2).unwrap().scene;
    let lookup = scene.lookup();
    let top = 0.8 * 450e-6;
    for (height, permittivity) in [
        (-2e-3, 1.5),
        (-1.5e-3, 4.5),
        (-1e-5, 4.5),
        (1e-5, 2.8),
        (top - 1e-6, 2.8),
        (top + 1e-6, 3.25),
        (top + 9e-5, 3.25),
        (1e-3, 1.5),
    ] {
        // In a corner that no electrode reaches.
        assert_eq!(lookup.permittivity_at([1e-2, height, 1e-2]), permittivity, "{height}");
    }
}

#[test]
fn the_walls_stand_off_by_the_margin_along_the_width_too() {
    let domain = at(&pair(Layout::InPlane), 0.3).unwrap().scene.domain;
    assert_close(domain.max[2], 250e-6 + 1e-3);
    assert_close(domain.min[2], -250e-6 - 1e-3);
}

#[test]
fn a_fixed_dielectric_ends_at_the_walls() {
    let mut case = pair(Layout::InPlane);
    let region = |min: f64, max: f64| Shape::Box(Box3 { min: [min; 3], max: [max; 3] });
    for (name, shape) in [
        ("inside", region(1e-4, 2e-4)),
        ("above", region(5e-4, 1.0)),
        ("below", region(-1.0, 3e-4)),
        ("beyond", region(0.5, 1.0)),
    ] {
        case.bodies.push(Body::dielectric(name, shape, 5.0));
    }
    let scene = at(&case, 0.1).unwrap().scene;
    let found: Vec<_> = scene.dielectrics().filter(|d| d.relative_permittivity == 5.0).collect();
    let names: Vec<_> = found.iter().map(|d| d.body.name.as_str()).collect();
    assert_eq!(names, ["inside", "above", "below"], "what lies outside is left out");
    for dielectric in found {
        let Box3 { min, max } = dielectric.body.bounds().unwrap();
        for a in 0..3 {
            // A face outside would be a plane of the grid.
            for x in [min[a], max[a]].into_iter().filter(|x| x.is_finite()) {
                assert!((scene.domain.min[a]..=scene.domain.max[a]).contains(&x), "{min:?} {max:?}");
            }
        }
    }
}
