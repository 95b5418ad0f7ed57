//! The catalogue and the page of an arm.

use truegrind_arm::robots::{Robot, catalogue, load, parse};
use truegrind_report::format::{csv, markdown, terminal};
use truegrind_report::robots as view;
use truegrind_report::table::Cell;

use super::examples::leave;

fn all() -> Vec<Robot> {
    catalogue().iter().map(|name| load(name).unwrap()).collect()
}

#[test]
fn the_catalogue_has_a_row_for_each_arm() {
    let robots = all();
    let table = view::catalogue_table(&robots);
    assert_eq!(table.rows.len(), robots.len());
    let text = csv::table(&table);
    assert_eq!(text.lines().next(), Some("name,maker,model,payload_kg,reach_mm,repeatability_mm,dialect"));
    assert!(text.lines().any(|line| line.starts_with("abb-irb-120,ABB,") && line.ends_with(",RAPID")));
}

#[test]
fn what_a_sheet_does_not_state_is_a_dash() {
    let jr680 = load("hsr-jr680").unwrap();
    assert!(jr680.sheet.joints.min_deg.is_none());
    let table = view::joint_table(&jr680);
    assert_eq!(table.rows[0][1], Cell::Missing);
    assert!(terminal::table(&table, 80).contains('–'));
}

#[test]
fn every_page_names_links_sources_and_published_poses() {
    for robot in all() {
        let name = robot.sheet.name.clone();
        let page = view::document(&robot);
        let text = markdown::document(&page);
        for heading in ["## Links", "## Joints", "## Published poses", "## Sources"] {
            assert!(text.contains(heading), "{name}: no {heading}");
        }
        let published = view::published_table(&robot);
        assert_eq!(published.rows.len(), robot.sheet.published.len());
        for row in &published.rows {
            let (Cell::Number(miss), Cell::Number(tolerance)) = (&row[4], &row[5]) else {
                panic!("{name}: {row:?}")
            };
            assert!(miss <= tolerance, "{name}: {row:?}");
        }
        assert_eq!(view::json(&robot)["sheet"]["name"], name);
        leave(&format!("robot-{name}.html"), &page);
    }
}

#[test]
fn angles_of_the_link_table_are_degrees() {
    let table = view::link_table(&load("abb-irb-120").unwrap());
    assert_eq!(table.columns[4].label(), "α [°]");
    let numbers = |column: usize| -> Vec<f64> {
        table.rows.iter().map(|row| if let Cell::Number(v) = row[column] { v } else { f64::NAN }).collect()
    };
    assert_eq!(numbers(4)[0], -90.0);
    assert_eq!(numbers(2)[1], 270.0);
}

#[test]
fn a_coupled_joint_is_told_in_words() {
    let mut sheet = load("abb-irb-120").unwrap().sheet;
    let mut map = [[0.0; 6]; 6];
    (0..6).for_each(|i| map[i][i] = 1.0);
    map[1][1] = -1.0;
    map[2][1] = 1.0;
    map[5][4] = -0.5;
    sheet.joints.map = Some(map);
    sheet.published.clear();
    let robot = Robot::new(sheet, "test.toml").unwrap();
    let notes = view::joint_table(&robot).notes.join("\n");
    assert!(notes.contains("rotation of joint 2 is −q2 in"), "{notes}");
    assert!(notes.contains("rotation of joint 3 is q2 + q3 in"), "{notes}");
    assert!(notes.contains("rotation of joint 6 is −0.5 · q5 + q6 in"), "{notes}");
    assert!(!notes.contains("joint 1"), "{notes}");
    // Without a published pose the page says that nothing checks the links.
    assert!(markdown::document(&view::document(&robot)).contains("nothing checks the links"));
}

#[test]
fn a_users_sheet_without_sources_shows_dashes_and_warns() {
    let text = r#"
        [[robot]]
        name = "bare"
        [[robot.link]]
        model = "dh"
        a_mm = 0
        d_mm = 300
        alpha_deg = -90
        theta_deg = 0
        [[robot.link]]
        model = "dh"
        a_mm = 250
        d_mm = 0
        alpha_deg = 0
        theta_deg = -90
        [[robot.link]]
        model = "dh"
        a_mm = 60
        d_mm = 0
        alpha_deg = -90
        theta_deg = 0
        [[robot.link]]
        model = "dh"
        a_mm = 0
        d_mm = 300
        alpha_deg = 90
        theta_deg = 0
        [[robot.link]]
        model = "dh"
        a_mm = 0
        d_mm = 0
        alpha_deg = -90
        theta_deg = 0
        [[robot.link]]
        model = "dh"
        a_mm = 0
        d_mm = 70
        alpha_deg = 0
        theta_deg = 0
    "#;
    let robot = parse(text, "bare.toml").unwrap();
    let sources = view::source_table(&robot);
    assert!(sources.rows.iter().all(|row| row[1] == Cell::Missing));
    let page = terminal::document(&view::document(&robot), 100);
    assert!(page.contains("[warning] The robot file can be used with reservations"), "{page}");
    assert!(page.contains("No masses are stated"), "{page}");
}
