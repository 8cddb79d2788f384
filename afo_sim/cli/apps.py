"""The command line's applications, which the modules of this package hang their commands on."""

import typer

app = typer.Typer(
    name="afo-sim",
    help="Simulate ankle-foot orthoses with pneumatic artificial muscles.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
gait_app = typer.Typer(no_args_is_help=True, rich_markup_mode=None)
app.add_typer(gait_app, name="gait", help="Bring your own walking data, and look at it.")
