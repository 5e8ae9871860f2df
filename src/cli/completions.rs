//! `matdb completions`.

use std::ffi::{OsStr, OsString};
use std::path::PathBuf;

use clap_complete::Shell;
use clap_complete::engine::{
    ArgValueCompleter, CompletionCandidate, PathCompleter, ValueCompleter,
};
use clap_complete::env::{EnvCompleter, Shells};

use super::console::write_out;
use crate::error::Error;
use crate::material::builtin;
use crate::setup::Database;

/// Print a completion script for a shell, which knows the materials of the database, too
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb completions bash > ~/.local/share/bash-completion/completions/matdb
  echo 'source <(matdb completions zsh)' >> ~/.zshrc        after its compinit
  matdb completions fish > ~/.config/fish/completions/matdb.fish

The script asks `matdb` on your path. Names come from the database that --db or MATDB names, else from \
matdb.sqlite in the working directory, and from the built-in materials. Print the script again after \
an update of matdb.")]
pub(super) struct Args {
    /// The shell
    shell: Shell,
    /// What the script asks for: the words of a command line, the program's name first
    #[arg(last = true, hide = true)]
    words: Vec<OsString>,
}

/// Materials that an argument can name.
#[derive(Clone, Copy, PartialEq)]
enum Names {
    BuiltIn,
    Stored,
    Any,
    AnyOrFile,
}

/// The arguments that take materials, by their commands.
const MATERIALS: [(&str, &str, Names); 17] = [
    ("add", "names", Names::BuiltIn),
    ("cite", "name", Names::Any),
    ("diagnose", "material", Names::Stored),
    ("diff", "before", Names::Any),
    ("diff", "after", Names::Any),
    ("export", "material", Names::Any),
    ("fit", "what", Names::AnyOrFile),
    ("fit", "save", Names::Stored),
    ("history", "name", Names::Stored),
    ("measure", "save", Names::Stored),
    ("near", "material", Names::Any),
    ("plot", "material", Names::Any),
    ("predict", "material", Names::Any),
    ("rm", "names", Names::Stored),
    ("show", "name", Names::Any),
    ("withdraw", "name", Names::Stored),
    ("withdraw", "superseded_by", Names::Any),
];

/// `command` is the whole command line.
pub(super) fn run(args: &Args, command: clap::Command, db: &Database) -> Result<(), Error> {
    let name = args.shell.to_string();
    let shells = Shells::builtins();
    let Some(shell) = shells.completer(&name) else {
        return Err(Error::usage(
            format!("there are no completions for {name}"),
            "choose another shell",
        ));
    };
    let text = if args.words.is_empty() {
        script(shell)
    } else {
        answer(shell, args.words.clone(), command, db)
    };
    write_out(&text)
}

/// The script, which asks this command.
fn script(shell: &dyn EnvCompleter) -> String {
    let mut script = Vec::new();
    // Memory takes all that is written.
    let _ = shell.write_registration("MATDB_COMPLETES", "matdb", "matdb", "matdb", &mut script);
    let words = format!(" completions {} -- ", shell.name());
    String::from_utf8_lossy(&script).replace(" -- ", &words)
}

/// What may stand in place of the word at the cursor, as the script expects it.
fn answer(
    shell: &dyn EnvCompleter,
    words: Vec<OsString>,
    mut command: clap::Command,
    db: &Database,
) -> String {
    let db = named_database(&words).map_or(db.clone(), |path| Database::new(Some(&path)));
    for (name, argument, names) in MATERIALS {
        let db = db.clone();
        let completer = ArgValueCompleter::new(move |typed: &OsStr| candidates(typed, names, &db));
        command = command.mut_subcommand(name, |one| {
            one.mut_arg(argument, |argument| argument.add(completer.clone()))
        });
    }
    let (mut text, folder) = (Vec::new(), std::env::current_dir().ok());
    // Words that make no sense get no proposals.
    let _ = shell.write_complete(&mut command, words, folder.as_deref(), &mut text);
    String::from_utf8_lossy(&text).into_owned()
}

/// The value of `--db` among words that nobody has parsed. Bash parts them at `=` and leaves `~` as it is.
fn named_database(words: &[OsString]) -> Option<PathBuf> {
    let mut words = words.iter().filter_map(|word| word.to_str()).filter(|word| *word != "=");
    let flag = words.find(|word| *word == "--db" || word.starts_with("--db="))?;
    let path = flag.strip_prefix("--db=").or_else(|| words.next())?;
    match path.strip_prefix("~/").zip(std::env::home_dir()) {
        Some((rest, home)) => Some(home.join(rest)),
        None => Some(path.into()),
    }
}

/// Names that begin as typed. Without a database that can be read they are those of the built-in materials.
fn candidates(typed: &OsStr, names: Names, db: &Database) -> Vec<CompletionCandidate> {
    let begun = typed.to_string_lossy();
    let mut found = Vec::new();
    if names != Names::BuiltIn
        && let Ok(Some(store)) = db.read()
        && let Ok(listed) = store.list()
    {
        found.extend(listed.into_iter().map(|line| (line.slug.to_string(), line.name)));
    }
    if names != Names::Stored {
        let added: Vec<String> = found.iter().map(|(slug, _)| slug.clone()).collect();
        let others = builtin::names().filter(|name| !added.iter().any(|slug| slug == name));
        found.extend(others.map(|name| (name.to_owned(), "built in".to_owned())));
    }
    found.retain(|(slug, _)| slug.starts_with(&*begun));
    let named = found
        .into_iter()
        .map(|(slug, title)| CompletionCandidate::new(slug).help(Some(title.into())));
    let files = (names == Names::AnyOrFile).then(|| PathCompleter::file().complete(typed));
    named.chain(files.into_iter().flatten()).collect()
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::cli::Cli;

    /// Otherwise a new command completes no names, or a renamed argument ends the completions of all.
    #[test]
    fn every_argument_that_takes_a_material_is_completed() {
        let cli = Cli::command();
        for (command, argument, _) in MATERIALS {
            let known = cli.find_subcommand(command).unwrap();
            assert!(known.get_arguments().any(|a| a.get_id() == argument), "{command} {argument}");
        }
        for command in cli.get_subcommands() {
            for argument in command.get_arguments() {
                let help = argument.get_help().map(ToString::to_string).unwrap_or_default();
                let (name, id) = (command.get_name(), argument.get_id().as_str());
                let is_listed = MATERIALS.iter().any(|(c, a, _)| (*c, *a) == (name, id));
                assert!(is_listed || !help.contains("NAME@REVISION"), "{name} {id}");
            }
        }
    }

    /// Each shell's script has one place where it asks the program.
    #[test]
    fn the_script_of_every_shell_asks_this_command() {
        for name in Shells::builtins().names() {
            let script = script(Shells::builtins().completer(name).unwrap());
            let asks = format!("completions {name} -- ");
            assert_eq!(script.matches(&asks).count(), 1, "{script}");
            assert_eq!(script.matches(" -- ").count(), 1, "{script}");
        }
    }
}
