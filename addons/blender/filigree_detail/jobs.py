"""Long work behind a button: Blender stays awake, the status bar says how far it is, Esc ends it."""

import threading

import bpy

from .library import filigree, missing


class _Worker:
    """Work on a thread of its own, which sees no Blender data."""

    def __init__(self, work):
        self.phase, self.fraction, self.cancelled = "", 0.0, False
        self.result = self.error = None
        self._thread = threading.Thread(target=self._run, args=(work,))
        self._thread.start()

    def _run(self, work):
        try:
            self.result = work(self._tell)
        except BaseException as error:  # handed to the thread that waits
            self.error = error

    def _tell(self, phase, fraction):
        self.phase, self.fraction = phase, fraction
        return not self.cancelled

    def is_done(self):
        return not self._thread.is_alive()


class JobOperator:
    """An operator whose `run(context)` is a generator. It yields (phase, fraction) between steps of its own, and a
    function of `progress` for work that needs no Blender data; the function's result comes back from the yield.
    From a script and in the background everything runs in one go."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        if filigree is None:
            cls.poll_message_set(missing)
            return False
        return context.object is not None and context.object.type == "MESH" and context.mode == "OBJECT"

    def execute(self, context):
        job, sent = self.run(context), None
        try:
            while True:
                asked = job.send(sent)
                sent = asked(None) if callable(asked) else None
        except StopIteration:
            return {"FINISHED"}
        except (filigree.Error, OSError) as error:
            return self._failed(error)

    def invoke(self, context, event):
        if bpy.app.background:
            return self.execute(context)
        self._job, self._worker, self._told = self.run(context), None, ("", 0.0)
        manager = context.window_manager
        manager.progress_begin(0, 100)
        self._timer = manager.event_timer_add(0.02, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC" and event.value == "PRESS":
            if self._worker is None:
                return self._end(context, filigree.Cancelled("Cancelled."))
            self._worker.cancelled = True
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        try:
            self._advance()
        except StopIteration:
            return self._end(context, None)
        except (filigree.Error, OSError) as error:
            return self._end(context, error)
        except BaseException:
            self._end(context, None)
            raise
        phase, fraction = self._told
        context.window_manager.progress_update(100 * fraction)
        context.workspace.status_text_set(f"Filigree: {phase} {100 * fraction:.0f} %   (Esc ends it)")
        return {"RUNNING_MODAL"}

    def _advance(self):
        """One step of the job, or a look at its worker."""
        sent = None
        if self._worker is not None:
            self._told = (self._worker.phase, self._worker.fraction)
            if not self._worker.is_done():
                return
            worker, self._worker = self._worker, None
            if worker.error is not None:
                raise worker.error
            sent = worker.result
        asked = self._job.send(sent)
        if callable(asked):
            self._worker = _Worker(asked)
        else:
            self._told = asked

    def _end(self, context, error):
        self._job.close()
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)
        return {"FINISHED"} if error is None else self._failed(error)

    def _failed(self, error):
        self.report({"INFO"} if isinstance(error, filigree.Cancelled) else {"ERROR"}, str(error))
        return {"CANCELLED"}
