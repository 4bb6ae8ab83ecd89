//! What the README says is what there is.

use std::fs;
use std::path::Path;

fn read(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn the_first_program_of_the_readme_is_the_example_and_has_15_lines() {
    let example = read("client/examples/first.rs");
    let (_, program) = example.split_once("\n\n").expect("a comment, then the program");
    assert!(
        read("README.md").contains(program.trim_end()),
        "the README shows another program than client/examples/first.rs"
    );
    let lines = program.lines().filter(|line| !line.trim().is_empty()).count();
    assert!(lines <= 15, "{lines} lines");
}

#[test]
fn ci_calls_the_test_command_of_the_readme() {
    let readme = read("README.md");
    let commands: Vec<&str> = readme.lines().filter_map(|line| line.strip_prefix("$ cargo ")).collect();
    assert_eq!(commands, ["run --release -- demo", "test --workspace"]);
    assert!(read(".ci/run").lines().any(|line| line.starts_with("cargo test --workspace")));
}

#[test]
fn links_of_the_documents_lead_somewhere() {
    for document in [
        "README.md",
        "docs/architecture.md",
        "docs/protocol.md",
        "docs/effects.md",
        "docs/operations.md",
        "docs/robustness.md",
    ] {
        let folder = Path::new(document).parent().unwrap_or(Path::new(""));
        let text = read(document);
        let links = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        for link in links.filter(|link| !link.contains("://") && !link.starts_with('#')) {
            let target = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(folder).join(link);
            assert!(target.exists(), "{document} links to {link}");
        }
    }
}
