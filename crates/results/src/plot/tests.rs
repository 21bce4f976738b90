use super::*;

fn series(name: &str, points: &[(f64, f64)]) -> Series {
    Series { name: name.into(), points: points.to_vec(), band: None, style: Style::LineAndMarkers }
}

fn chart(scale: Scale, series: Vec<Series>) -> Chart {
    Chart {
        title: "Capacitance against force".into(),
        x: Axis { label: "force".into(), unit: "N".into(), scale },
        y: Axis { label: "capacitance".into(), unit: "F".into(), scale },
        series,
    }
}

/// Every text of the file, without its markup.
fn texts(svg: &str) -> Vec<String> {
    let parts = svg.split("<text ").skip(1).filter_map(|part| part.split("</text>").next());
    let strip = |part: &str| {
        let content = part.split_once('>').map_or("", |(_, content)| content);
        content.split('<').map(|piece| piece.rsplit('>').next().unwrap_or("")).collect()
    };
    parts.map(strip).collect()
}

fn count(svg: &str, what: &str) -> usize {
    svg.matches(what).count()
}

/// Checks that elements are closed in order, and that attributes hold no stray quotes or brackets.
fn assert_well_formed(svg: &str) {
    let mut open = Vec::new();
    for tag in svg.split('<').skip(1) {
        let (tag, text) = tag.split_once('>').expect("a tag ends");
        assert!(!text.contains('>') && tag.matches('"').count() % 2 == 0, "{tag} {text}");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') {
            open.push(tag.split_whitespace().next().expect("a tag has a name"));
        }
    }
    assert!(open.is_empty(), "{open:?}");
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
}

#[test]
fn axes_take_the_prefix_that_suits_the_numbers() {
    let svg = chart(Scale::Linear, vec![series("a", &[(0.0, 31e-15), (0.25, 36e-15)])]).to_svg();
    let texts = texts(&svg);
    assert!(texts.contains(&"force (mN)".to_owned()), "{texts:?}");
    assert!(texts.contains(&"capacitance (fF)".to_owned()), "{texts:?}");
    assert!(texts.contains(&"250".to_owned()) && texts.contains(&"32".to_owned()), "{texts:?}");
}

#[test]
fn a_curve_nine_times_smaller_brings_zero_into_the_axis() {
    let svg = chart(
        Scale::Linear,
        vec![
            series("with fringing", &[(0.0, 31e-15), (0.3, 36e-15)]),
            series("plates", &[(0.0, 3.5e-15), (0.3, 4e-15)]),
        ],
    );
    assert!(texts(&svg.to_svg()).iter().filter(|t| *t == "0").count() == 2);
}

#[test]
fn logarithmic_ticks_carry_the_unit_or_a_power_of_ten() {
    let mut chart = chart(Scale::Logarithmic, vec![series("a", &[(1e-3, 1e-2), (20.0, 1e-9)])]);
    chart.y.unit = String::new();
    let svg = chart.to_svg();
    let texts = texts(&svg);
    for wanted in ["1 mN", "100 mN", "10 N", "10\u{2212}8", "10\u{2212}2", "force", "capacitance"] {
        assert!(texts.contains(&wanted.to_owned()), "{wanted} {texts:?}");
    }
}

#[test]
fn less_than_a_decade_has_ticks_too() {
    for (low, high) in [(1.0, 3.0), (1.01, 1.05), (0.9e-7, 4e-7), (5.0, 5.0)] {
        let svg = chart(Scale::Logarithmic, vec![series("a", &[(low, low), (high, high)])]).to_svg();
        assert!(texts(&svg).len() >= 2 + 2 + 4, "{low} {high} {:?}", texts(&svg));
        assert_well_formed(&svg);
    }
}

#[test]
fn missing_points_break_the_line_and_are_not_drawn() {
    let points =
        [(0.0, 1.0), (1.0, 2.0), (2.0, f64::NAN), (3.0, 2.0), (4.0, 3.0), (f64::INFINITY, 1.0), (5.0, 1.0)];
    let svg = chart(Scale::Linear, vec![series("", &points)]).to_svg();
    assert_eq!((count(&svg, "<polyline"), count(&svg, "<circle")), (2, 5));
    let svg = chart(Scale::Logarithmic, vec![series("", &[(1.0, 1.0), (2.0, 0.0), (3.0, -1.0), (4.0, 2.0)])])
        .to_svg();
    assert_eq!((count(&svg, "<polyline"), count(&svg, "<circle")), (0, 2));
}

#[test]
fn one_point_equal_values_no_points_and_extreme_ranges_are_ordinary() {
    let cases: [&[(f64, f64)]; 10] = [
        &[],
        &[(0.0, 0.0)],
        &[(0.3, 31e-15)],
        &[(1.0, 5.0), (2.0, 5.0)],
        &[(1.0, -5.0), (1.0, -5.0)],
        &[(1e15, 1.0), (1e15 + 1.0, 1.0 + 1e-15)],
        &[(-1e300, 1e-300), (1e300, 1e300)],
        &[(f64::MAX, f64::MIN_POSITIVE), (f64::MIN, 5e-324)],
        &[(f64::NAN, f64::NAN)],
        &[(1e-9, 1e9), (1e9, 1e-9)],
    ];
    for scale in [Scale::Linear, Scale::Logarithmic] {
        for points in cases {
            let svg = chart(scale, vec![series("a", points)]).to_svg();
            assert_well_formed(&svg);
            assert!(texts(&svg).len() < 60, "{points:?}");
        }
    }
    assert!(chart(Scale::Linear, vec![]).to_svg().contains("no data"));
}

#[test]
fn text_is_escaped() {
    let mut chart = chart(Scale::Linear, vec![series("<a> & \"b\" 'c'\u{0}", &[(0.0, 1.0)])]);
    chart.title = "x < y & \"z\"".into();
    chart.x.label = "a<b".into();
    let svg = chart.to_svg();
    assert_well_formed(&svg);
    assert!(svg.contains("&lt;a&gt; &amp; &quot;b&quot; &#39;c&#39; "));
}

#[test]
fn a_band_is_shaded_along_a_line_and_drawn_as_bars_otherwise() {
    let mut with_band = series("a", &[(1.0, 2.0), (2.0, 3.0), (3.0, 4.0)]);
    with_band.band = Some(vec![(1.5, 2.5), (2.5, 3.5), (3.5, 4.5)]);
    let shaded = chart(Scale::Linear, vec![with_band.clone()]).to_svg();
    assert_eq!(count(&shaded, "fill-opacity=\"0.2\"/>"), 2);
    with_band.style = Style::Markers;
    let bars = chart(Scale::Linear, vec![with_band.clone()]).to_svg();
    assert_eq!((count(&bars, "fill-opacity"), count(&bars, "stroke-width=\"1.4\"")), (0, 3));
    // A lower bound of zero reaches to the end of a logarithmic axis; an infinite or missing one draws
    // nothing.
    with_band.band = Some(vec![(0.0, 2.5), (2.5, f64::INFINITY)]);
    let bars = chart(Scale::Logarithmic, vec![with_band]).to_svg();
    assert_eq!(count(&bars, "stroke-width=\"1.4\""), 1);
    assert_well_formed(&bars);
}

#[test]
fn series_differ_in_colour_and_marker() {
    let many: Vec<_> =
        (0..9).map(|i| series(&format!("s{i}"), &[(0.0, f64::from(i)), (1.0, f64::from(i))])).collect();
    let svg = chart(Scale::Linear, many).to_svg();
    for colour in ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#333333"] {
        assert!(svg.contains(colour));
    }
    assert!(svg.contains("stroke-dasharray=\"2 4\""));
}

#[test]
fn the_same_chart_gives_the_same_bytes() {
    let make = || chart(Scale::Linear, vec![series("a", &[(0.1, 1.0 / 3.0), (0.7, 2.0 / 3.0)])]).to_svg();
    assert_eq!(make(), make());
}

#[test]
fn dimensionless_numbers_far_from_one_name_their_power_of_ten() {
    let mut chart = chart(Scale::Linear, vec![series("a", &[(0.0, 2e-6), (0.3, 9e-6)])]);
    chart.y.unit = String::new();
    chart.x.unit = "%".into();
    let texts = texts(&chart.to_svg());
    assert!(texts.contains(&"capacitance (\u{d7}10\u{2212}6)".to_owned()), "{texts:?}");
    assert!(texts.contains(&"force (%)".to_owned()), "{texts:?}");
}

#[test]
fn a_cloud_is_small_and_faint_behind_the_series_whose_colour_it_has() {
    let mut chart =
        chart(Scale::Linear, vec![series("line", &[(1.0, 1.0), (2.0, 2.0)]), series("", &[(1.5, 1.0)])]);
    chart.series[1].style = Style::Cloud { like: 0 };
    let svg = chart.to_svg();
    let faint = svg.find("r=\"2.93\" fill=\"#0072b2\" fill-opacity=\"0.4\"").unwrap();
    assert!(faint < svg.find("<polyline").unwrap(), "{svg}");
}

#[test]
fn panels_share_a_title_and_the_place_of_every_x() {
    let upper = chart(Scale::Linear, vec![series("change", &[(0.0, 0.0), (0.2, 7.5)])]);
    let lower = chart(Scale::Linear, vec![series("whole", &[(0.0, 31.25e-15), (0.2, 33.5e-15)])]);
    let panels = Panels { title: "a sensor".into(), main: upper, second: Some(lower), third: None };
    let svg = panels.to_svg();
    assert_well_formed(&svg);
    let found = texts(&svg);
    assert_eq!(found.iter().filter(|text| *text == "a sensor").count(), 1, "{found:?}");
    assert!(!found.contains(&"Capacitance against force".to_owned()), "{found:?}");
    // The two frames, without that of the page, begin and end at the same x.
    let frames: Vec<_> = svg.split("<rect x=").skip(1).filter(|r| r.contains("fill=\"none\"")).collect();
    let place = |r: &str| -> Vec<String> { r.split('"').skip(1).step_by(2).map(str::to_owned).collect() };
    let [a, b] = [place(frames[0]), place(frames[1])];
    assert_eq!((a[0].as_str(), a[2].as_str()), (b[0].as_str(), b[2].as_str()));
    let alone = Panels { second: None, ..panels };
    assert!(alone.to_svg().contains("height=\"500\"") && !svg.contains("height=\"500\""));
}
