//! tmp
#[test]
fn big() {
    let mut fs: Vec<_> = std::fs::read_dir("/tmp/big").unwrap().map(|e| e.unwrap().path()).collect();
    fs.sort();
    for f in fs {
        let t = std::time::Instant::now();
        let e = elastocap_coupling::case::load(&f).unwrap_err();
        let a = t.elapsed();
        let s = e.render(true);
        println!("{} {:?} {:?} len {}", f.display(), a, t.elapsed(), s.len());
        println!("{}", s.chars().take(600).collect::<String>());
    }
}
