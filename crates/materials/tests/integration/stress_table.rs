//! Measured stress over compression.

use elastocap_materials::StressTable;
use elastocap_materials::stress_table::CompressionMatch;

fn table() -> StressTable {
    StressTable {
        compression: vec![0.0, 0.1, 0.4, 0.6],
        loading: vec![0.0, 4e3, 4e3, 12e3],
        unloading: Some(vec![0.0, 1e3, 2e3, 12e3]),
    }
}

#[test]
fn between_its_points_a_table_is_straight_and_beyond_them_it_says_nothing() {
    let table = table();
    for (compression, loading, unloading) in
        [(0.0, 0.0, 0.0), (0.05, 2e3, 500.0), (0.3, 4e3, 5e3 / 3.0), (0.6, 12e3, 12e3)]
    {
        assert!((table.loading_at(compression).unwrap() - loading).abs() < 1e-9);
        assert!((table.unloading_at(compression).unwrap() - unloading).abs() < 1e-9);
    }
    assert_eq!((table.loading_at(0.61), table.unloading_at(0.61)), (None, None));
    assert_eq!(StressTable { unloading: None, ..table }.unloading_at(0.1), None);
}

#[test]
fn a_stress_belongs_to_one_compression_a_plateau_or_none() {
    let table = table();
    assert_eq!(table.compression_under(0.0), CompressionMatch::At(0.0));
    assert_eq!(table.compression_under(4e3), CompressionMatch::Between([0.1, 0.4]));
    assert_eq!(table.compression_under(12e3), CompressionMatch::At(0.6));
    assert_eq!(table.compression_under(12.1e3), CompressionMatch::Beyond);
    for stress in [1e-3, 3e3, 4.1e3, 11.9e3] {
        let CompressionMatch::At(compression) = table.compression_under(stress) else { panic!("{stress}") };
        assert!((table.loading_at(compression).unwrap() / stress - 1.0).abs() < 1e-12);
    }
}
