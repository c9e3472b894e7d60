// Open MPI unloads its plug-ins before the leak check: without their symbols no suppression can name them.
extern "C" int dlclose(void*) { return 0; }
