//! Prints docs/commands.md, the reference of the command line, from the definitions behind `--help`:
//!
//!     cargo run --example commands > docs/commands.md

use clap::{Arg, Command, CommandFactory};

/// The page with the table of what each command is in Python.
const PYTHON: &str = include_str!("../docs/python.md");

/// What writes the page.
pub const COMMAND: &str = "cargo run --example commands > docs/commands.md";

fn main() {
    print!("{}", page());
}

/// The whole page.
pub fn page() -> String {
    let mut program = matdb::cli::Cli::command();
    program.build();
    let mut text = format!(
        "# Commands\n\nGenerated from the program's `--help` by `{COMMAND}`; edit the help instead. `matdb help COMMAND` shows \
         the same.\n\nEvery command takes these options:\n\n"
    );
    text += &list(program.get_arguments().filter(|argument| argument.is_global_set()));
    let is_described = |command: &&mut Command| command.get_name() != "help";
    for command in program.get_subcommands_mut().filter(is_described) {
        let name = command.get_name().to_owned();
        text += &format!("\n## {name}\n{}", section(command, &name));
        for inner in command.get_subcommands_mut().filter(is_described) {
            let name = format!("{name} {}", inner.get_name());
            text += &format!("\n### {name}\n{}", section(inner, &name));
        }
    }
    text
}

/// One command by its whole name: what it does, how it is called, its arguments and its examples.
fn section(command: &mut Command, name: &str) -> String {
    let about = command.get_about().map(ToString::to_string).unwrap_or_default();
    let usage = command.render_usage().to_string();
    let usage = usage.trim_start_matches("Usage: ");
    let mut text = format!("\n{}.\n\n```text\n{usage}\n```\n\n", prose(&about));
    let own = command.get_arguments().filter(|a| !a.is_global_set() && a.get_id() != "help");
    text += &list(own);
    if let Some(call) = in_python(name) {
        text += &format!("\n[In Python](python.md#commands-in-python): {call}.\n");
    }
    if let Some(after) = command.get_after_long_help().or(command.get_after_help()) {
        text += &format!("\n```text\n{}\n```\n", wrapped(after.to_string().trim_end()));
    }
    text
}

/// What a command is in Python, where it is anything.
fn in_python(command: &str) -> Option<&'static str> {
    let start = format!("| `{command}` | ");
    PYTHON.lines().find_map(|row| row.strip_prefix(&start)?.strip_suffix(" |"))
}

/// Text with lines of at most 100 characters, as in a terminal; examples are shorter.
fn wrapped(text: &str) -> String {
    const WIDTH: usize = 100;
    let mut wrapped = String::new();
    for line in text.lines() {
        let mut length = 0;
        for word in line.split_inclusive(' ') {
            let is_full = length > 0 && length + word.trim_end().chars().count() > WIDTH;
            if is_full {
                wrapped.truncate(wrapped.trim_end_matches(' ').len());
                wrapped.push('\n');
                length = 0;
            }
            wrapped += word;
            length += word.chars().count();
        }
        wrapped.push('\n');
    }
    wrapped.trim_end().to_owned()
}

/// An item for each argument; empty where there is none.
fn list<'a>(arguments: impl Iterator<Item = &'a Arg>) -> String {
    arguments.map(item).collect()
}

fn item(argument: &Arg) -> String {
    let help = argument.get_long_help().or(argument.get_help()).map(ToString::to_string);
    let mut meaning = prose(&help.unwrap_or_default());
    let is_flag = !argument.get_action().takes_values();
    let defaults: Vec<_> =
        argument.get_default_values().iter().map(|value| value.to_string_lossy()).collect();
    if !is_flag && !defaults.is_empty() && !argument.is_hide_default_value_set() {
        meaning += &format!(" [default: `{}`]", defaults.join(","));
    }
    if let Some(variable) = argument.get_env() {
        meaning += &format!(" [env: `{}`]", variable.to_string_lossy());
    }
    if !is_flag && !argument.is_hide_possible_values_set() {
        meaning += &possible_values(argument);
    }
    format!("- `{}`: {meaning}\n", name(argument))
}

/// The values to choose from: an item for each where they have help.
fn possible_values(argument: &Arg) -> String {
    let values = argument.get_possible_values();
    let shown: Vec<_> = values.iter().filter(|value| !value.is_hide_set()).collect();
    let names = shown.iter().map(|value| format!("`{}`", value.get_name()));
    if shown.is_empty() {
        return String::new();
    }
    if shown.iter().all(|value| value.get_help().is_none()) {
        return format!(" [{}]", names.collect::<Vec<_>>().join(", "));
    }
    let helps = shown.iter().map(|value| value.get_help().map(ToString::to_string));
    names
        .zip(helps)
        .map(|(name, help)| format!("\n  - {name}: {}", prose(&help.unwrap_or_default())))
        .collect()
}

/// As an argument is typed: `-o, --output <DIR>` or `<SCENE>`.
fn name(argument: &Arg) -> String {
    let short = argument.get_short().map(|short| format!("-{short}"));
    let long = argument.get_long().map(|long| format!("--{long}"));
    let value = if argument.get_action().takes_values() {
        let names = argument.get_value_names().unwrap_or_default();
        names.iter().map(|name| format!("<{name}>")).collect::<Vec<_>>().join(" ")
    } else {
        String::new()
    };
    let flags = [short, long].into_iter().flatten().collect::<Vec<_>>().join(", ");
    format!("{flags} {value}").trim().to_owned()
}

/// Help on one line, with what Markdown would read as markup quoted.
fn prose(help: &str) -> String {
    let line = help.split_whitespace().collect::<Vec<_>>().join(" ");
    line.replace('<', "&lt;").replace("[[", "\\[\\[")
}
