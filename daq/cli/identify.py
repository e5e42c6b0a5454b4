"""`armhil identify`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import (
    Columns,
    Json,
    NoCatalogue,
    Parameters,
    Quiet,
    RobotOfRecording,
    catalogue_of,
    code_of,
    console_of,
    file_of,
    print_json,
    steps_of,
    there,
)
from daq.cli.log_options import (
    GainOfLog,
    OffsetOfLog,
    PayloadsOfLogs,
    RatioOfLog,
    SampleRate,
    SaveMap,
    SaveRobot,
    TorqueSensors,
    UrdfOfLog,
    guess_request_of,
)


@app.command()
def identify(
    paths: Annotated[
        list[Path],
        typer.Argument(help="Captures (.mcap), or logs that a column map describes.", callback=there),
    ],
    robot: RobotOfRecording = None,
    columns: Columns = None,
    validate: Annotated[
        list[Path] | None,
        typer.Option(help="A recording to predict and not to fit to; may be repeated.", callback=there),
    ] = None,
    method: Annotated[
        str, typer.Option(help="auto, or an estimator: ls, iv, consistent, …; a wrong name lists all.")
    ] = "auto",
    covariance: Annotated[
        str | None,
        typer.Option(help="iid, block, ar, hc, hac, cluster or bootstrap.", show_default="settings"),
    ] = None,
    friction: Annotated[
        str | None, typer.Option(help="symmetric or asymmetric.", show_default="settings")
    ] = None,
    essential: Annotated[
        bool, typer.Option("--essential", help="Find the essential parameters by F-tests.")
    ] = False,
    cutoff: Annotated[
        str | None,
        typer.Option(help="Low-pass for q: Hz, or auto for the proposed one.", show_default="settings"),
    ] = None,
    rate: Annotated[
        float | None, typer.Option(min=0.1, help="Rows per second after decimation.", show_default="settings")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for report and model file.")] = None,
    save_urdf: Annotated[
        Path | None,
        typer.Option("--save-urdf", help="Write the arm's URDF with the identified inertias here."),
    ] = None,
    model: Annotated[
        Path | None,
        typer.Option(
            "--model",
            help="A model file whose found effects belong to the model.",
            show_default="usual",
            callback=file_of("a model file (*.model.toml)"),
        ),
    ] = None,
    payload: PayloadsOfLogs = None,
    urdf: UrdfOfLog = None,
    sample_rate: SampleRate = None,
    ratio: RatioOfLog = None,
    gain: GainOfLog = None,
    offset: OffsetOfLog = None,
    torque_sensors: TorqueSensors = False,
    save_map: SaveMap = None,
    save_robot: SaveRobot = None,
    no_catalogue: NoCatalogue = False,
    quiet: Quiet = False,
    parameters: Parameters = False,
    as_json: Json = False,
) -> int:
    """Identify an arm from recordings and say whether the model can be trusted.

    Example: [bold]armhil identify runs/first/capture.mcap --out runs/again[/]
    A log of any arm: [bold]armhil identify log.csv --urdf arm.urdf[/]
    """
    from daq.identification.carried import carried_of
    from daq.identification.identification_json import identification_json
    from daq.identification.identify import IdentifyRequest, run_identify
    from daq.identification.identify_options import cutoff_of, method_of
    from daq.identification.terminal import print_guessed, print_identification
    from daq.text.wrapped import write

    console = console_of(as_json)
    request = IdentifyRequest(
        tuple(paths),
        robot,
        columns,
        cutoff_of(cutoff),
        rate,
        out,
        method=method_of(method),
        covariance=covariance,
        friction=friction,
        validate=tuple(validate or ()),
        essential=essential,
        urdf=save_urdf,
        model=model,
        carried=carried_of(payload or ()),
        guess=guess_request_of(
            urdf,
            robot,
            sample_rate,
            {"ratio": ratio, "gain": gain, "offset": offset},
            torque_sensors,
            save_map,
            save_robot,
        ),
    )
    catalogue = catalogue_of(no_catalogue or out is None)
    result = run_identify(request, steps_of(console, quiet))
    if catalogue is not None:
        from daq.keeping.keep import keep_request  # loads the database and the search

        keep_request(catalogue, request, result)
    if as_json:
        print_json(identification_json(result.fitted.result, [str(path) for path in paths]))
    print_guessed(console, result.guessed)
    print_identification(console, result.fitted, model=result.model, parameters=parameters)
    if result.report is not None:
        write(console, f"\nReport: {result.report}")
    if result.urdf is not None:
        write(console, f"URDF: {result.urdf}")
    return code_of(result.fitted.result)
