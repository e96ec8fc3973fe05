"""Inside FreeCAD 0.20, without a screen: make a CAM job, and post it as FreeCAD's own command does.

The task comes as JSON in the variable GCODEJERK_TASK, since `freecadcmd` takes every word of its
command line for a file: {"posts": {name: {"arguments": ..., "file": ...}}, "answer": file}. The
answer is JSON, too: {name: message of the error, or null}. A script that fails ends `freecadcmd`
with status 0, so the status is told by hand.
"""

import json
import os
import sys
import traceback

SIZE = (80.0, 50.0, 15.0)
HOLES = ((7.0, 7.0), (73.0, 7.0), (73.0, 43.0), (7.0, 43.0))
POCKET = (24.0, 15.0, 32.0, 20.0, 6.0)
"""Corner, size and depth. [mm]"""


def make_part(document, app):
    """A plate with four through holes and a pocket with round corners."""
    import Part

    x, y, width, height, depth = POCKET
    body = Part.makeBox(*SIZE)
    for at in HOLES:
        body = body.cut(Part.makeCylinder(2.5, SIZE[2], app.Vector(*at, 0)))
    tub = Part.makeBox(width, height, depth, app.Vector(x, y, SIZE[2] - depth))
    corners = [e for e in tub.Edges if e.BoundBox.ZLength > 0.9 * depth]
    part = document.addObject("Part::Feature", "Bracket")
    part.Shape = body.cut(tub.makeFillet(4.0, corners))
    document.recompute()
    return part


def make_tool(job, bit, number, feed):
    """A tool of FreeCAD's library with a controller of its own."""
    import PathScripts.PathPreferences as Preferences
    import PathScripts.PathToolBit as ToolBit
    import PathScripts.PathToolController as ToolController

    library = Preferences.pathDefaultToolsPath("Bit")
    tool = ToolBit.Factory.CreateFrom(os.path.join(library, bit))
    if not hasattr(tool, "ToolType"):  # the stock post for Fanuc asks for it
        tool.addProperty("App::PropertyString", "ToolType")
    tool.ToolType = "Drill" if "Drill" in bit else "EndMill"
    controller = ToolController.Create(f"T{number}", tool, number)
    controller.HorizFeed = controller.VertFeed = f"{feed} mm/min"
    controller.HorizRapid = controller.VertRapid = "5000 mm/min"
    controller.SpindleSpeed = 8000.0
    job.Proxy.addToolController(controller)
    return controller


def make_job(app):
    """Drilling, a pocket and the outline, with two tools."""
    import Part
    import PathScripts.PathDrilling as Drilling
    import PathScripts.PathJob as Job
    import PathScripts.PathPocketShape as Pocket
    import PathScripts.PathProfile as Profile
    import PathScripts.PathUtils as Utils

    document = app.newDocument("bracket")
    job = Job.Create("Job", [make_part(document, app)], None)
    document.recompute()
    for unused in job.Tools.Group:
        unused.ToolNumber = 90
    drill = make_tool(job, "5mm_Drill.fctb", 2, 120)
    mill = make_tool(job, "5mm_Endmill.fctb", 1, 600)
    model = job.Model.Group[0]

    class Chosen:
        """Where there are several tools, FreeCAD asks the user which; here it is told."""

        def __init__(self):
            self.tool = None

        def selectedToolController(self):  # noqa: N802
            return self.tool

        def chooseToolController(self, controllers):  # noqa: N802
            return self.tool

        def chooseJob(self, jobs):  # noqa: N802
            return jobs[0]

    Utils.UserInput = chosen = Chosen()

    def faces(wanted):
        names = [f"Face{k}" for k, face in enumerate(model.Shape.Faces, 1) if wanted(face)]
        assert names
        return [(model, tuple(names))]

    def floor(face):
        box = face.BoundBox
        return box.ZLength < 1e-6 and abs(box.ZMax - (SIZE[2] - POCKET[4])) < 1e-6

    def hole(face):
        return isinstance(face.Surface, Part.Cylinder) and abs(face.Surface.Radius - 2.5) < 1e-6

    chosen.tool = drill
    # `Create` looks for holes before it knows the model.
    holes = document.addObject("Path::FeaturePython", "Drilling")
    holes.Proxy = Drilling.ObjectDrilling(holes, "Drilling", job)
    holes.ToolController, holes.Base = drill, faces(hole)
    chosen.tool = mill
    pocket = Pocket.Create("Pocket", None, job)
    pocket.ToolController, pocket.Base = mill, faces(floor)
    pocket.StepOver, pocket.StepDown = 50, 3
    outline = Profile.Create("Outline", None, job)
    outline.ToolController, outline.StepDown = mill, 7.5
    document.recompute()
    for operation in (holes, pocket, outline):
        assert len(operation.Path.Commands) > 5, f"{operation.Label} is empty"
    return job


def main(task):
    """Make the job, post it as often as asked."""
    import FreeCAD
    import PathScripts.PathPost as Post

    job = make_job(FreeCAD)
    answer = {}
    for name, post in task["posts"].items():
        job.PostProcessor = post.get("processor", "gcodejerk")
        job.PostProcessorArgs, job.PostProcessorOutputFile = post["arguments"], post["file"]
        command = Post.CommandPathPost()
        try:
            for objects in command.buildPostList(job):
                command.exportObjectsWith(objects, job)
            answer[name] = None
        except Exception as error:
            answer[name] = f"{type(error).__name__}: {error}"
    with open(task["answer"], "w", encoding="utf-8") as file:
        json.dump(answer, file)


if "GCODEJERK_TASK" in os.environ:
    status = 0
    try:
        main(json.loads(os.environ["GCODEJERK_TASK"]))
    except BaseException:
        traceback.print_exc()
        status = 1
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)
