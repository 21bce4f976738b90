use std::path::Path;
#[test]
fn show() {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/acceptance");
    for d in [dir.clone(), dir.join("bad")] {
        let mut files: Vec<_> = std::fs::read_dir(d).unwrap().map(|e| e.unwrap().path()).collect();
        files.sort();
        for f in files {
            if f.extension().is_some_and(|e| e == "toml") {
                println!("=== {}", f.file_name().unwrap().display());
                match elastocap_coupling::case::load(&f) { Ok(c) => println!("{c:#?}"), Err(e) => println!("{e}") }
            }
        }
    }
    println!("{}", serde_json::to_string_pretty(&elastocap_coupling::case::json_schema()).unwrap());
}
