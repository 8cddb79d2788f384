"""The command line's applications, on which the modules of this package register their commands."""

import typer

from afo_sim.cli.error_handler import Commands, print_version

EPILOGUE = """Exit codes:

\b
0    done
1    a check, a published number or a replayed case differs; what is asked of a size does not suffice
2    wrong input, or the system refuses: disk, permission, memory
3    unstable, or its controller failed; its rows up to there are written
70   a fault of this program; a file to send is written
130  stopped by Ctrl-C
143  stopped by SIGTERM
"""
SETTINGS = {"help_option_names": ["-h", "--help"]}

app = typer.Typer(
    name="afo-sim",
    cls=Commands,
    help="Simulate ankle-foot orthoses with pneumatic artificial muscles.",
    epilog=EPILOGUE,
    context_settings=SETTINGS,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
gait_app = typer.Typer(cls=Commands, no_args_is_help=True, rich_markup_mode=None)
app.add_typer(gait_app, name="gait", help="Bring your own walking data, and look at it.")
leg_app = typer.Typer(cls=Commands, no_args_is_help=True, rich_markup_mode=None)
app.add_typer(leg_app, name="leg", help="Bring your own leg from MJCF or URDF; take one elsewhere.")


@app.callback()
def _options(
    version: bool = typer.Option(
        False, "--version", callback=print_version, is_eager=True, help="print the version, and stop"
    ),
) -> None:
    pass
