//! Electrodes in the layer.

use elastocap_mechanics::{
    ClosedFormSettings, ElectrodePose, ElectrodeStiffness, LayerMap, LayerState, MooneyRivlin,
};

use super::support::{PAPER, PAPER_MU, assert_close};

const H: f64 = 450e-6;
const S: f64 = 225e-6;

#[test]
fn the_audited_electrode_pair_is_met() {
    let settings =
        ClosedFormSettings { contact_half_length: 500e-6, contact_width: 500e-6, shear_length: 500e-6 };
    for (compression, gap, height, thickness, force) in [
        (0.05, 52.98956076, 217.8473042, 19.896405, 0.01419374329),
        (0.1, 56.37846961, 210.4400439, 19.7848551, 0.03183618032),
        (0.2, 64.70120634, 194.7853711, 19.52528034, 0.08309948987),
        (0.3, 75.93866034, 177.8653002, 19.18246189, 0.172631884),
        (0.4, 91.7851518, 159.4773126, 18.67890049, 0.343679075),
    ] {
        let layer = LayerState::new(H, PAPER, compression, settings).unwrap();
        let pose = layer.electrode_pose(S, ElectrodeStiffness::ShearModulus(1e6)).unwrap();
        assert_close(1e6 * pose.gap(50e-6), gap, 2e-10, "gap");
        assert_close(1e6 * pose.height, height, 4e-10, "height");
        assert_close(1e6 * pose.thickness(20e-6), thickness, 4e-10, "thickness");
        assert_close(layer.force(), force, 5e-10, "force");
        assert_close(pose.length(300e-6) * pose.thickness(20e-6), 300e-6 * 20e-6, 1e-15, "volume");
    }
}

#[test]
fn an_electrode_as_soft_as_the_layer_thins_as_the_layer_does() {
    for compression in [0.0, 1e-10, 0.05, 0.4, 0.99] {
        let map = LayerMap::new(H, compression).unwrap();
        let same = ElectrodeStiffness::ShearModulus(PAPER_MU);
        let pose = ElectrodePose::new(&map, PAPER_MU, S, same).unwrap();
        assert_close(pose.thickness_stretch, 1.0 / map.stretch(S), 1e-15, "t/T = 1/f");
        assert_close(pose.length_stretch, map.stretch(S), 1e-15, "T/t = f");
    }
}

#[test]
fn the_stiffer_the_electrode_the_less_it_thins() {
    let map = LayerMap::new(H, 0.4).unwrap();
    let pose = |stiffness| ElectrodePose::new(&map, PAPER_MU, S, stiffness).unwrap();
    let mut last = 0.0;
    for exponent in -12..=24 {
        let thickness = pose(ElectrodeStiffness::ShearModulus(10_f64.powi(exponent))).thickness_stretch;
        assert!(thickness >= last && thickness <= 1.0);
        last = thickness;
    }
    assert_close(last, 1.0, 1e-15, "as stiff as can be");
    let rigid = pose(ElectrodeStiffness::Rigid);
    assert_eq!((rigid.thickness_stretch, rigid.length_stretch), (1.0, 1.0));
    // An electrode a million million times softer: t/T = sqrt(mu_e / (mu (f^2 - f^-2))).
    let soft = pose(ElectrodeStiffness::ShearModulus(1e-12 * PAPER_MU)).thickness_stretch;
    let f2 = map.stretch(S).powi(2);
    assert_close(soft, 1e-6 / (f2 - 1.0 / f2).sqrt(), 1e-14, "as soft as can be");
}

#[test]
fn the_electrode_carries_the_stress_difference_of_the_layer() {
    let settings =
        ClosedFormSettings { contact_half_length: 500e-6, contact_width: 500e-6, shear_length: 500e-6 };
    let layer = LayerState::new(H, PAPER, 0.3, settings).unwrap();
    let sigma = layer.stress().cauchy([0.0, S, 0.0]);
    let modulus = 3e5;
    let s = layer.electrode_pose(S, ElectrodeStiffness::ShearModulus(modulus)).unwrap().thickness_stretch;
    let carried = modulus * (s * s - 1.0 / (s * s));
    assert_close(carried, sigma[(1, 1)] - sigma[(0, 0)], 1e-14, "sigma22 - sigma11");
}

#[test]
fn stacked_plates_come_closer_and_without_load_stay() {
    let plates = |compression: f64| {
        let map = LayerMap::new(H, compression).unwrap();
        [120e-6, 330e-6].map(|s| ElectrodePose::new(&map, 1e5, s, ElectrodeStiffness::Rigid).unwrap().height)
    };
    assert_eq!(plates(0.0), [120e-6, 330e-6]);
    let mut last = 210e-6;
    for k in 1..=9 {
        let [below, above] = plates(0.1 * f64::from(k));
        assert!(above - below < last && above > below);
        last = above - below;
    }
}

#[test]
fn without_load_an_electrode_is_as_made() {
    let map = LayerMap::new(H, 0.0).unwrap();
    let soft = ElectrodeStiffness::ShearModulus(1.0);
    let modulus = MooneyRivlin::neo_hookean(1e5).shear_modulus();
    let pose = ElectrodePose::new(&map, modulus, S, soft).unwrap();
    assert_eq!(
        (pose.gap(50e-6), pose.height, pose.thickness(20e-6), pose.length(3e-4)),
        (50e-6, S, 20e-6, 3e-4)
    );
}
