//! What makes the command line comfortable: completions, man pages, colour where it is seen and nowhere else.

use std::fs;

use assert_cmd::Command;

use super::{folder, truegrind};

#[test]
fn every_shell_gets_its_completions() {
    let dir = folder();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let (code, out, err) = truegrind(dir.path(), &["completions", shell]);
        assert_eq!(code, 0, "{shell}: {err}");
        for word in ["compensate", "diagnose", "max-correction"] {
            assert!(out.contains(word), "{shell}: {word}");
        }
    }
    let (code, _, err) = truegrind(dir.path(), &["completions", "cmd"]);
    assert!(code == 2 && err.contains("bash") && err.contains("fish"), "{err}");
}

#[test]
fn the_man_page_and_those_of_all_verbs() {
    let dir = folder();
    let at = dir.path();
    let (code, out, err) = truegrind(at, &["man"]);
    assert!(code == 0 && out.contains(".TH truegrind 1") && out.contains("compensate"), "{out}{err}");
    let (code, _, err) = truegrind(at, &["man", "-o", "man"]);
    assert_eq!(code, 0, "{err}");
    let (_, help, _) = truegrind(at, &["--help"]);
    let commands = help.split_once("Commands:").unwrap().1.split_once("Options:").unwrap().0;
    for line in commands.lines().filter(|line| line.starts_with("  ") && !line.starts_with("   ")) {
        let verb = line.split_whitespace().next().unwrap();
        if verb != "help" {
            let page = fs::read_to_string(at.join(format!("man/truegrind-{verb}.1"))).unwrap();
            assert!(page.contains(&format!(".TH truegrind-{verb} 1")), "{page}");
        }
    }
}

/// Colour is for who sees it: none into a pipe, none where NO_COLOR is set, none on a dumb terminal.
#[test]
fn colour_obeys_no_color_and_pipes() {
    let dir = folder();
    let run = |variables: &[(&str, &str)], arguments: &[&str]| -> String {
        let mut command = Command::cargo_bin("truegrind").unwrap();
        command.current_dir(dir.path()).env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE").args(arguments);
        for (name, value) in variables {
            command.env(name, value);
        }
        let output = command.output().unwrap();
        [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat()
    };
    for arguments in
        [&["--help"][..], &["compensate", "nothing.mod", "--model", "nothing.toml", "-o", "out.mod"]]
    {
        assert!(!run(&[], arguments).contains('\u{1b}'), "{arguments:?}: a pipe");
        assert!(run(&[("CLICOLOR_FORCE", "1")], arguments).contains('\u{1b}'), "{arguments:?}: forced");
        let both = [("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")];
        assert!(!run(&both, arguments).contains('\u{1b}'), "{arguments:?}: NO_COLOR");
        assert!(!run(&[("TERM", "dumb")], arguments).contains('\u{1b}'), "{arguments:?}: dumb");
    }
}

/// The recipe of docs/simulate.md, as it stands there.
#[test]
fn the_recipe_of_the_manual_is_simulated() {
    let page = include_str!("../../../docs/simulate.md");
    let recipe = page.split_once("```toml recipe\n").unwrap().1.split_once("```").unwrap().0;
    let dir = folder();
    let at = dir.path();
    let still = recipe.replace("approach = \"sequence\"", "");
    for (recipe, middle) in [(recipe, false), (still.as_str(), true)] {
        fs::write(at.join("recipe.toml"), recipe).unwrap();
        let (code, _, err) =
            truegrind(at, &["simulate", "recipe.toml", "-o", "data.csv", "--arm", "arm.toml"]);
        assert_eq!(code, 0, "{err}");
        assert!(err.contains("200 rows"), "{err}");
        assert_eq!(err.contains("in the middle of the play"), middle, "{err}");
    }
}
